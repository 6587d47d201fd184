"""``params.yaml`` as frozen, validated sections; ``config.loader`` reads the file."""
