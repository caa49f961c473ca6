"""Extended XYZ: a text format, read by OVITO and ASE."""

import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pyverlet.data.trajectory import Frame, Reader, Walls, Writer
from pyverlet.world.world import World

PROPERTIES = "species:S:1:pos:R:3:velo:R:3:radius:R:1:mass:R:1:spin:R:1:id:I:1"  # columns, in the notation of the format

_FIELD = re.compile(r'(\w+)=(?:"([^"]*)"|(\S+))')


class XyzWriter(Writer):
    """Writes frames as a count, a comment line, and a line per circle, with enough digits to restore every bit."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb", buffering=0)  # unbuffered: frames reach the file as a whole
        self._walls = Walls()

    def add(self, frame: Frame, world: World) -> None:
        digits = "%.9g" if frame.position.dtype == np.float32 else "%.17g"
        x0, y0, x1, y1 = self._walls.around(frame, world)
        text = io.StringIO()
        text.write(f'{len(frame)}\nLattice="{x1 - x0:.9g} 0 0 0 {y1 - y0:.9g} 0 0 0 1" Origin="{x0:.9g} {y0:.9g} 0" ')
        text.write(f'pbc="F F F" Properties={PROPERTIES} Time={frame.time!r} state_hash="{frame.state_hash}"\n')
        columns = (frame.position, frame.velocity, frame.radius, frame.mass, frame.spin, frame.number)
        line = f"C {digits} {digits} 0 {digits} {digits} 0 {digits} {digits} {digits} %d\n"
        rows = zip(
            *(column for array in columns for column in (array.T.tolist() if array.ndim == 2 else [array.tolist()])), strict=True
        )
        text.writelines(line % row for row in rows)
        data = memoryview(text.getvalue().encode())
        while data:
            data = data[self._file.write(data) or 0 :]


class XyzReader(Reader):
    """Reads files of `XyzWriter`. An incomplete last frame is left out."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        try:
            self._at = list(self._whole())
        except ValueError:
            self._file.close()
            raise

    def _whole(self) -> Iterator[tuple[int, int]]:
        """Offset of the second line of each complete frame, and its number of particles."""
        while head := self._file.readline():
            if not head.strip().isdigit():
                raise ValueError(f"{head[:40]!r} is no number of particles")
            count, start = int(head), self._file.tell()
            last = self._file.readline()
            if last.endswith(b"\n") and PROPERTIES.encode() not in last:
                raise ValueError(f"its columns are not {PROPERTIES}")
            for _ in range(count):
                last = self._file.readline()
            if not last.endswith(b"\n"):
                return
            yield start, count

    def __len__(self) -> int:
        return len(self._at)

    def frame(self, k: int) -> Frame:
        start, count = self._at[k]
        self._file.seek(start)
        about = {name: quoted or plain for name, quoted, plain in _FIELD.findall(self._file.readline().decode())}
        rows = [self._file.readline().split()[1:] for _ in range(count)]
        table = np.array(rows, dtype=np.float64).reshape(count, 10)
        return Frame(
            time=float(about["Time"]),
            position=table[:, 0:2],
            velocity=table[:, 3:5],
            radius=table[:, 6],
            mass=table[:, 7],
            spin=table[:, 8],
            number=np.array([int(row[-1]) for row in rows], np.int64),
            state_hash=about.get("state_hash", ""),
        )
