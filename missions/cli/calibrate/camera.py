"""`treepilot calibrate camera`: intrinsics of a camera from pictures of a ChArUco board."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.cli.calibrate.camera_report import HEADER, report, snippet
from stack.errors import InputError

if TYPE_CHECKING:
    from stack.perception.camera.board import Board, BoardParameters, BoardView

DOTS_PER_METRE = 300 / 0.0254
"""Resolution of the board to print: 300 dots per inch."""


def camera(  # noqa: PLR0913 - options
    images: Annotated[
        list[Path] | None, typer.Argument(help="pictures of the board, or a folder with pictures")
    ] = None,
    squares: Annotated[
        str, typer.Option(metavar="COLUMNSxROWS", help="squares of the board")
    ] = "7x5",
    square: Annotated[str, typer.Option(metavar="LENGTH", help="side of a square")] = "30 mm",
    marker: Annotated[str, typer.Option(metavar="LENGTH", help="side of a marker")] = "22 mm",
    dictionary: Annotated[
        str, typer.Option(metavar="NAME", help="dictionary of the markers")
    ] = "DICT_4X4_50",
    legacy: Annotated[
        bool, typer.Option("--legacy", help="board drawn by OpenCV before 4.6")
    ] = False,
    terms: Annotated[
        int, typer.Option(help="distortion coefficients: 0, 1 (k1), 2 (k2), 4 (p1 p2) or 5 (k3)")
    ] = 5,
    write: Annotated[
        Path | None, typer.Option(metavar="FILE", help="write the keys for a robot file")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="draw the corners and a rectified view")
    ] = None,
    board: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="write the board to print")
    ] = None,
) -> None:
    """Calibrate a camera by pictures of a ChArUco board.

    Print the board with `--board board.png` and glue it to something flat. Take 10 to 20 sharp
    pictures with the board tilted to all sides, also in the corners of the picture. The printed
    keys go into the camera of a robot file.
    """
    from stack.perception.camera.board import Board

    wanted = Board(_parameters(squares, square, marker, dictionary, legacy))
    for path in (board, picture):
        if path is not None and path.suffix.lower() != ".png":
            raise InputError(f"{path}: the name of a picture must end with .png")
    if board is not None:
        _write_board(wanted, board)
    if images:
        _calibrate(images, wanted, terms, write, picture)
    elif board is None:
        raise InputError("name pictures of the board, or write the board with --board board.png")


def _parameters(
    squares: str, square: str, marker: str, dictionary: str, legacy: bool
) -> "BoardParameters":
    from stack.parameters import build
    from stack.perception.camera.board import BoardParameters

    columns, cross, rows = squares.lower().replace("×", "x").partition("x")
    if not (cross and columns.strip().isdecimal() and rows.strip().isdecimal()):
        raise InputError(f"--squares {squares}: expected COLUMNSxROWS, such as 7x5")
    return build(
        BoardParameters,
        {
            "columns": int(columns), "rows": int(rows), "square": square, "marker": marker,
            "dictionary": dictionary, "legacy": legacy,
        },
    )  # fmt: skip


def _write_board(board: "Board", path: Path) -> None:
    from stack.perception.camera.board import png

    p = board.parameters
    path.write_bytes(png(board.drawn(DOTS_PER_METRE), DOTS_PER_METRE))
    size = f"{1000 * p.square * (p.columns + 1):g} x {1000 * p.square * (p.rows + 1):g} mm"
    typer.echo(f"wrote {path}: {p}; print it in its size, {size}, and measure a square")


def _calibrate(
    images: list[Path], board: "Board", terms: int, write: Path | None, picture: Path | None
) -> None:
    from stack.perception.camera.calibration import TERMS, calibrate
    from stack.perception.camera.pictures import overview, picture_files, read_grey

    if terms not in TERMS:
        raise InputError(f"--terms {terms}: expected one of {', '.join(map(str, TERMS))}")
    if write is not None:
        _require_replaceable(write)
    files = picture_files(images)
    views = _found(files, board)
    usable = {file: view for file, view in views.items() if not view.rejected}
    first = read_grey(files[0])
    result = calibrate(list(usable.values()), (first.shape[1], first.shape[0]), terms)
    for line in (*report(result, list(usable)), "", *snippet(result, board, len(usable))):
        typer.echo(line)
    if write is not None:
        write.write_text("\n".join(snippet(result, board, len(usable))) + "\n", "utf-8")
        typer.echo(f"wrote {write}", err=True)
    if picture is not None:
        from stack.perception.camera.board import encoded

        shown = overview(read_grey(next(iter(usable))), list(usable.values()), result)
        picture.write_bytes(encoded(shown))
        typer.echo(f"wrote {picture}", err=True)


def _require_replaceable(path: Path) -> None:
    """Raise InputError if the file exists and no calibration has written it."""
    if path.exists() and not (path.is_file() and path.read_bytes().startswith(HEADER.encode())):
        raise InputError(
            f"{path} exists and was not written by treepilot calibrate camera; choose another name "
            "for --write, then copy the keys"
        )


def _found(files: Sequence[Path], board: "Board") -> dict[Path, "BoardView"]:
    """Find the board in each picture; print what was found.

    Raises:
        InputError: a file is not a picture, or has another size than the first one.
    """
    from stack.perception.camera.pictures import read_grey

    views: dict[Path, BoardView] = {}
    size: tuple[int, ...] = ()
    for number, file in enumerate(files, 1):
        grey = read_grey(file)
        size = size or grey.shape
        if grey.shape != size:
            raise InputError(
                f"{file} has {grey.shape[1]} x {grey.shape[0]} pixels, {files[0]} has {size[1]} x "
                f"{size[0]}; all pictures must come from one camera at one resolution"
            )
        views[file] = view = board.find(grey)
        corners = f"{len(view.corners)} of {board.corner_count} corners"
        outcome = f"not used: {view.rejected}" if view.rejected else corners
        typer.echo(f"[{number}/{len(files)}] {file.name}: {outcome}")
    return views
