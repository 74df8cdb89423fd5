"""Study: many variants in a folder of its own, begun anew or continued."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cellplan.model.progress import Progress, silent
from cellplan.study.folder import prepare_folder
from cellplan.study.journal import Journal
from cellplan.study.run import Evaluate, run_trials
from cellplan.study.variants import Variant


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """What is tried and where it is recorded.

    Attributes:
        folder: Folder of the study; an earlier study there is replaced, or continued.
        header: What the study is about, as plain data: an earlier study with another header is not continued.
        variants: All variants.
    """

    folder: Path
    header: Mapping[str, Any]
    variants: Sequence[Variant]

    def run(
        self, evaluate: Evaluate, *, workers: int | Executor = 1, resume: bool = False, progress: Progress = silent
    ) -> list[dict[str, Any]]:
        """Evaluate all variants and record each as soon as those before it are done.

        Args:
            evaluate: Outcome of a variant; sent to the workers, so it must be picklable.
            workers: Number of processes; or an executor, which stays open.
            resume: Whether variants that the folder holds already are not evaluated again.
            progress: Called with the stage and the fraction done.

        Returns:
            All trials as plain data, in the order of the variants.

        Raises:
            InputError: The folder cannot be used, or holds another study that is to be continued.
            KeyboardInterrupt: It was interrupted; says how many variants are recorded.
        """
        prepare_folder(self.folder, resume=resume)
        with Journal(self.folder, self.header, self.variants, resume=resume) as journal:
            try:
                trials = run_trials(self.variants, evaluate, journal, workers=workers, progress=progress)
            except KeyboardInterrupt:
                done = f"{len(journal.trials)} of {len(self.variants)} variants are recorded"
                raise KeyboardInterrupt(f"interrupted: {done} in {self.folder}; --resume goes on from there") from None
        return [trial.record for trial in trials]
