"""One row of the table of `docs/torture.md`: a trial, and how often it held."""

from dataclasses import dataclass, field


@dataclass
class Row:
    """Trials of one kind: `what` was tried, how often, and a sentence for each that did not hold.

    `note` is a word on what came where all held, such as the number of files that opened.
    """

    what: str
    count: int = 0
    faults: list[str] = field(default_factory=list)
    note: str = ""

    def add(self, *faults: str) -> None:
        """Count one trial; it held unless it has faults."""
        self.count += 1
        if faults:
            self.faults.append("; ".join(faults))

    @property
    def held(self) -> int:
        """How many trials held."""
        return self.count - len(self.faults)
