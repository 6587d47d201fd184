"""What a forecast is held against, and what the twin stands on: closed forms and other models."""
