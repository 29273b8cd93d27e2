"""`treepilot map`: works on saved maps."""

from pathlib import Path
from typing import Annotated

import typer

map_app = typer.Typer(no_args_is_help=True, help="Merge saved maps.")

Saved = Annotated[Path, typer.Argument(help="folder of a map saved with `localisation: slam`")]


@map_app.callback()
def _map() -> None:
    pass


@map_app.command("merge")
def merge(
    first: Saved,
    second: Saved,
    out: Annotated[Path, typer.Option("--out", metavar="FOLDER", help="folder to write")],
) -> None:
    """Merge two maps by the places that both have seen.

    The result is in the frame of the first map, with the markers that both have mapped. A folder
    that exists is kept as .bak. Maps without a common place are an error (exit code 2), and nothing
    is written.
    """
    from stack.mapping.graph_files import read_graph, saved_files
    from stack.mapping.marker_maps import MARKERS_YAML, marker_map_text
    from stack.mapping.saved_maps import folder_contents
    from stack.mapping.slam.landmarks import markers_of, solve
    from stack.mapping.slam.merging import merge as merged_of
    from stack.mapping.whole_files import replace_folder

    merged = merged_of(read_graph(first), read_graph(second))
    graph, pose = merged.mapper.graph, merged.placement.pose
    files = saved_files(graph)
    if graph.landmarks:
        markers = markers_of(graph, solve(merged.mapper.problem()))
        files[MARKERS_YAML] = marker_map_text(markers, "of two merged maps").encode()
    replace_folder(out, folder_contents(merged.mapper.grid(), files))
    typer.echo(
        f"wrote {out}: {len(graph.keyframes)} keyframes, {merged.joints} matches between the maps;"
        f" {second} lies at ({pose.x:.2f}, {pose.y:.2f}, {pose.heading:.2f} rad) in {first}"
    )
