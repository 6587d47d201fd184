"""The rule by which the alias ``champion`` moves: a comparison on development recordings."""

from dataclasses import dataclass

from odisar.config.registry import ChampionRule

CHAMPION = "champion"


@dataclass(frozen=True)
class Standing:
    """What a version of a model reached; ``auroc`` is None, with a reason, where it is unknown."""

    version: str
    auroc: float | None
    unknown_because: str = ""


@dataclass(frozen=True)
class Decision:
    """Whether the alias moves to the challenger, and why, with both numbers."""

    moves: bool
    sentence: str


def decide(
    model: str, challenger: Standing, champion: Standing | None, rule: ChampionRule
) -> Decision:
    """Decide between a new version and the present champion, measured on the same recordings."""
    new = f"version {challenger.version}"
    if champion is None:
        reached = "" if challenger.auroc is None else f" with {_number(challenger)}"
        return Decision(moves=True, sentence=f"{new} is the first{reached}: it became the champion")
    old = f"version {champion.version}"
    stayed = f"{old} stayed the champion"
    by_hand = f"`odisar promote {model} {challenger.version}` moves it by hand"
    for standing in (challenger, champion):
        if standing.auroc is None:
            why = f"version {standing.version}: {standing.unknown_because}"
            return Decision(moves=False, sentence=f"{stayed}, not compared ({why}); {by_hand}")
    assert challenger.auroc is not None  # noqa: S101 (looked at above)
    assert champion.auroc is not None  # noqa: S101
    margin = f" by more than {rule.margin:g}" if rule.margin else ""
    compared = f"{new} reached {_number(challenger)}, {old} {_number(champion)}"
    if challenger.auroc > champion.auroc + rule.margin:
        return Decision(moves=True, sentence=f"{compared}{margin}: {new} became the champion")
    return Decision(moves=False, sentence=f"{compared}: not better{margin}, {stayed}; {by_hand}")


def _number(standing: Standing) -> str:
    return f"AUROC {standing.auroc:.6f} (P2, development)"
