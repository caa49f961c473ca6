"""Python in processes of their own: what they say, and how they end."""

import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Self

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


def python(
    *arguments: str, cwd: Path | None = None, check: bool = False, timeout: float = 600, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run Python with these arguments to its end, with these variables beside those of this process."""
    return subprocess.run(
        [sys.executable, *arguments], cwd=cwd, check=check, timeout=timeout, env=os.environ | environment,
        capture_output=True, text=True,
    )  # fmt: skip


class Program:
    """Python that runs until it is told to end; left, it is killed."""

    def __init__(self, *arguments: str, cwd: Path | None = None, env: Mapping[str, str] | None = None) -> None:
        # Children take signals even if this process was started to ignore them, as by a shell in the background or by nohup.
        ignored = {each: signal.signal(each, signal.SIG_DFL) for each in SIGNALS}
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-u", *arguments], cwd=cwd, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
            )
        finally:
            for each, handler in ignored.items():
                signal.signal(each, handler)

    def line(self, holding: str = "", *, error: bool = False) -> str:
        """The next line on standard output, or error, that holds this."""
        lines = self.process.stderr if error else self.process.stdout
        assert lines is not None
        for line in lines:
            if holding in line:
                return line
        raise AssertionError(self.process.communicate()[1])

    def end(self, by: int = signal.SIGINT) -> tuple[str, str]:
        """End it by a signal, Ctrl-C unless another is named, without a traceback: what else it has said, and its errors."""
        self.process.send_signal(by)
        out, err = self.process.communicate(timeout=60)
        assert "Traceback" not in err
        return out, err

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self.process:
            self.process.kill()
