"""`treepilot export --mcap`: other programs find in the file what the run recorded."""

import json
import resource
import signal
from dataclasses import replace
from math import cos, sin

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from typer.testing import CliRunner

from missions.cli.app import app
from missions.execution.prepare import RunOptions, diagnose
from missions.execution.running import execute
from missions.inspection.exchange.exporting import export_mcap
from stack.errors import InputError
from stack.optional_packages import FOXGLOVE
from stack.telemetry.hub import SENSORS, SNAPSHOTS, Telemetry
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.sensor_log import SensorLog
from stack.telemetry.snapshots.log import SnapshotLog
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types import (
    CameraModel,
    DepthImage,
    Image,
    Imu,
    Limitation,
    Observation,
    Pose2D,
    RangeReading,
    RivalPose,
    Scan,
    TrackedObject,
)
from tests.stack.telemetry.foxglove_reader import chain, end_points, read, rigid, seconds
from tests.stack.telemetry.synthetic_run import RESOLUTION, SyntheticRun

STEPS, STEP = 80, 0.05
LAST = (STEPS - 1) * STEP
CAMERA = CameraModel(64, 48, 40.0, (0.2, 0.1, 0.5), pitch=0.3, yaw=0.4)


def snapshot_at(run, step):
    """A state with a drifted odometry, a mounted lidar, and things that come and go."""
    made = run.snapshot_at(step * STEP)
    scan = replace(made.scan, mount=Pose2D(0.1, -0.05, 0.5))
    track = TrackedObject(7, made.time, (6.0, 4.0), (0.0, 1.2), 0.3, np.eye(4), "person")
    return replace(
        made,
        odometry=Pose2D(0.3 * made.time, -0.2, 0.1 * made.time),
        scan=scan,
        path=made.path if step < STEPS // 2 else None,
        goal=made.goal if step < STEPS // 2 else None,
        tracks=(track,) if step < STEPS // 2 else (),
        rivals=(RivalPose(Pose2D(1.0, 2.0, 0.5), 0.3),),
        limitations=(Limitation("stopped", "obstacle", "obstacle 0.3 m ahead", (0.6, 0.1)),),
    )


def observation_at(step):
    """Measurements of sensors that snapshots do not hold, or not all of."""
    time = step * STEP
    ranges = np.full(1000, 2.0, np.float32)
    ranges[:3] = np.inf, np.nan, 3.0
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:, :, 0] = 200  # red
    return Observation(
        time,
        {
            "lidar": Scan(time, ranges, -2.0, 0.004, 0.1, 8.0, Pose2D(0.1, 0.0)),
            "front": RangeReading(time, float("inf"), 0.3, 0.05, 4.0),
            "imu": Imu(np.array([time]), np.array([[0.0, 0.0, 0.2]]), np.array([[0.0, 0.0, 9.81]])),
            "camera": Image(time, pixels, CAMERA),
            "depth": DepthImage(time, np.full((48, 64), 1.5, np.float32), CAMERA, 0.1, 5.0),
        },
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of a run of four seconds, with all sensors."""
    found, run = tmp_path_factory.mktemp("run"), SyntheticRun()
    sinks = [Recorder(RunFolder(found)), SnapshotLog(found / SNAPSHOTS, RecordingParameters())]
    telemetry, log = Telemetry(run.info(), sinks), SensorLog(found / SENSORS, {"mission": "m"})
    for step in range(STEPS):
        telemetry.advance(step, step * STEP)
        if step == 30:
            telemetry.emit(
                "doubt", "does it fit?", source="localisation", level="warning", health=0.25
            )
        log.write(observation_at(step))
        telemetry.publish(lambda step=step: snapshot_at(run, step))
    telemetry.close(None)
    log.close()
    (found / "mission.yaml").write_text("mission: m\n")
    return found


@pytest.fixture(scope="module")
def recorded(folder):
    """The recorded snapshots."""
    with SnapshotRecording(folder) as recording:
        return [recording.snapshot(number) for number in range(len(recording.times))]


@pytest.fixture(scope="module")
def file(folder, tmp_path_factory):
    found = tmp_path_factory.mktemp("exported") / "run.mcap"
    export_mcap(folder, found)
    return found


@pytest.fixture(scope="module")
def exported(file):
    return read(file)


def test_the_file_has_an_index_that_covers_all_of_it(file):
    """What Foxglove needs to open a large file at any time without reading it as a whole."""
    with file.open("rb") as opened:
        reader = make_reader(opened)
        summary, metadata = reader.get_summary(), list(reader.iter_metadata())
        attached = {item.name: item.data for item in reader.iter_attachments()}
    with file.open("rb") as opened:
        kinds = [type(record).__name__ for record in StreamReader(opened).records]
    assert summary.statistics.message_count == kinds.count("Message") > 100
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 0
    assert all(index.message_index_offsets for index in summary.chunk_indexes)
    assert all(index.compression == "zstd" for index in summary.chunk_indexes)
    assert kinds[0] == "Header" and kinds[-1] == "Footer"
    assert {channel.message_encoding for channel in summary.channels.values()} == {
        "protobuf", "json",
    }  # fmt: skip
    assert metadata[0].metadata["seed"] == "1"
    assert metadata[0].metadata["clock"].startswith("seconds since the start of the robot's clock")
    assert attached["mission.yaml"] == b"mission: m\n" and b"<robot" in attached["robot.urdf"]
    assert [item.name for item in file.parent.iterdir()] == [file.name]  # nothing half written


def test_the_same_run_gives_the_same_bytes(folder, file, tmp_path):
    export_mcap(folder, tmp_path / "again.mcap")
    assert (tmp_path / "again.mcap").read_bytes() == file.read_bytes()


def test_poses_are_those_of_the_recording_at_their_times(exported, recorded):
    for topic, pose_of in (
        ("/pose", lambda shot: shot.pose), ("/odometry", lambda shot: shot.odometry),
        ("/truth", lambda shot: shot.truth),
    ):  # fmt: skip
        assert len(exported[topic]) == len(recorded)
        for (time, message), shot in zip(exported[topic], recorded, strict=True):
            assert time == pytest.approx(shot.time, abs=1e-9)
            assert seconds(message.timestamp) == pytest.approx(shot.time, abs=1e-9)
            pose, found = pose_of(shot), rigid(message.pose.position, message.pose.orientation)
            assert found[:2, 3] == pytest.approx([pose.x, pose.y])
            assert found[:2, 0] == pytest.approx([cos(pose.heading), sin(pose.heading)])
    assert {message.frame_id for _, message in exported["/odometry"]} == {"odom"}
    assert {message.frame_id for _, message in exported["/pose"]} == {"map"}


def test_the_frames_lead_from_every_link_to_the_map(exported, recorded):
    """The lidar is 0.1 m ahead and 0.25 m above base_link in the robot's URDF."""
    _, fixed = exported["/tf_static"][-1]
    for (_, moving), shot in zip(exported["/tf"], recorded, strict=True):
        found, names = chain([fixed, moving], "lidar")
        assert names == ["lidar", "base_link", "base", "odom", "map"]
        pose = shot.pose
        assert found[:3, 3] == pytest.approx(
            [pose.x + 0.1 * cos(pose.heading), pose.y + 0.1 * sin(pose.heading), 0.25]
        )
        odometry, _ = chain([moving], "base")
        assert odometry[:2, 3] == pytest.approx([pose.x, pose.y])
    wheel, _ = chain([fixed], "left_wheel")
    assert wheel[:3, 3] == pytest.approx([0.0, 0.21, 0.09])


def test_scans_have_their_geometry(exported, recorded):
    assert len(exported["/scan"]) == len({shot.scan.stamp for shot in recorded})
    for (_, message), shot in zip(exported["/scan"], recorded, strict=True):
        assert message.frame_id == "base"
        assert seconds(message.timestamp) == pytest.approx(shot.scan.stamp)
        assert end_points(message) == pytest.approx(shot.scan.points(), abs=1e-5)


def test_sensor_logs_add_every_beam_and_every_measurement(exported):
    scans = exported["/sensors/lidar"]
    assert len(scans) == STEPS
    ranges = scans[0][1].ranges
    assert len(ranges) == 1000 and ranges[0] == float("inf") and np.isnan(ranges[1])
    assert scans[0][1].start_angle == pytest.approx(-2.0)
    assert scans[0][1].end_angle == pytest.approx(-2.0 + 999 * 0.004)
    assert exported["/sensors/front"][3][1]["distance"] is None  # infinite: JSON has no such number
    assert exported["/sensors/front"][3][0] == pytest.approx(0.15)
    assert exported["/sensors/imu"][0][1]["angular_velocity"] == [[0.0, 0.0, 0.2]]


def test_pictures_are_jpeg_in_the_frame_of_their_camera(exported):
    _, message = exported["/camera/image"][-1]
    decoded = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)
    assert message.format == "jpeg" and decoded.shape == (48, 64, 3)
    assert decoded.mean(axis=(0, 1)) == pytest.approx([0, 0, 200], abs=8)  # blue, green, red
    _, depth = exported["/depth/image"][-1]
    assert (depth.encoding, depth.width, depth.height, depth.step) == ("32FC1", 64, 48, 256)
    assert set(np.frombuffer(depth.data, "<f4")) == {1.5}
    _, calibration = exported["/camera/calibration"][-1]
    assert list(calibration.K) == pytest.approx([40, 0, 31.5, 0, 40, 23.5, 0, 0, 1])
    frames, names = chain([exported["/tf_static"][-1][1]], message.frame_id)
    assert names == ["camera_optical", "base"]
    assert frames == pytest.approx(CAMERA.base_from_optical())


def test_maps_have_their_cells_at_their_place(exported, recorded):
    """A cell is found by its value in the packed bytes; its centre lies on what occupies it."""
    _, grid = exported["/map"][0]
    source = recorded[0].layers["map"].content
    fields = {field.name: field for field in grid.fields}
    assert {name: field.offset for name, field in fields.items()} == {
        "red": 0, "green": 1, "blue": 2, "alpha": 3, "value": 4,
    }  # fmt: skip
    rows = len(grid.data) // grid.row_stride
    data = np.frombuffer(grid.data, np.uint8).reshape(rows, grid.column_count, grid.cell_stride)
    values = data[..., 4].view(np.int8)
    assert np.array_equal(values, source.cells)
    assert (grid.cell_size.x, grid.cell_size.y) == (RESOLUTION, RESOLUTION)
    row, column = 30, 189  # of the wall whose middle is at 9.4, 1.5
    x = grid.pose.position.x + (column + 0.5) * grid.cell_size.x
    y = grid.pose.position.y + (row + 0.5) * grid.cell_size.y
    assert (x, y) == (pytest.approx(9.475), pytest.approx(1.525)) and values[row, column - 1] == 100
    wall, floor = data[row, column - 1, :4], data[row, column - 20, :4]
    assert wall[:3].sum() > 2 * floor[:3].sum() and wall[3] == floor[3] == 255


def test_costmaps_follow_the_robot(exported, recorded):
    for time, grid in exported["/local_costmap"]:
        shot = next(item for item in recorded if item.time == pytest.approx(time))
        source = shot.layers["local_costmap"].content
        assert (grid.pose.position.x, grid.pose.position.y) == pytest.approx(source.origin)
        cells = np.frombuffer(grid.data, np.uint8).reshape(*source.cells.shape, 5)
        assert np.array_equal(cells[..., 4], source.cells)
    assert len(exported["/local_costmap"]) >= LAST  # one a second is recorded


def test_plans_end_with_an_empty_message(exported, recorded):
    paths = exported["/path"]
    assert len(paths[0][1].poses) == len(recorded[0].path.points)
    first, last = paths[0][1].poses[0], recorded[0].path.points[0]
    assert (first.position.x, first.position.y) == pytest.approx(tuple(last[:2]))
    assert len(paths[-1][1].poses) == 0 and paths[-1][0] == pytest.approx(STEPS // 2 * STEP)


def entities(message):
    assert [item.type for item in message.deletions] == [1]  # all, then what is there now
    return {item.id: item for item in message.entities}


def test_the_scene_shows_what_is_there_and_no_more(exported):
    before, after = entities(exported["/moving"][0][1]), entities(exported["/moving"][-1][1])
    assert before.keys() - after.keys() == {"goal", "track 7"}
    assert {"robot", "uncertainty", "truth", "people", "rivals", "limitation 0"} <= after.keys()
    arrow = before["track 7"].arrows[0]
    assert arrow.shaft_length + arrow.head_length == pytest.approx(1.2)  # metres in one second
    assert rigid(arrow.pose.position, arrow.pose.orientation)[:2, 0] == pytest.approx([0, 1])
    limit = after["limitation 0"]
    assert limit.frame_id == "base" and limit.texts[0].text == "stopped: obstacle 0.3 m ahead"
    assert limit.texts[0].pose.position.x == pytest.approx(0.6)
    person = after["people"].cylinders[1]
    assert (person.size.x, person.size.z) == (pytest.approx(0.44), pytest.approx(1.7))
    assert person.pose.position.z == pytest.approx(0.85)


def test_the_world_and_the_places(exported):
    world = entities(exported["/scene"][0][1])["world"]
    run = SyntheticRun()
    boxes = [shape for shape in run.scene if shape.kind == "box"]
    assert len(world.cubes) == len(boxes) and len(world.cylinders) == len(run.scene) - len(boxes)
    assert world.cubes[0].pose.position.z == pytest.approx(boxes[0].size[2] / 2)
    shown = entities(exported["/places"][0][1])["places"]
    assert [text.text for text in shown.texts] == ["dock", "kitchen", "meeting room"]
    assert len(shown.cubes) == 2  # fiducial markers


def test_the_robot_is_shown_in_the_frames_of_its_links(exported, recorded):
    """The lidar of the URDF is a cylinder of 12 cm, around its frame; wheels lie on their side."""
    shown = entities(exported["/robot"][0][1])
    assert {name: item.frame_id for name, item in shown.items()} == {
        name: name for name in ("base_link", "left_wheel", "right_wheel", "lidar")
    }
    lidar, wheel = shown["lidar"].cylinders[0], shown["left_wheel"].cylinders[0]
    assert (lidar.size.x, lidar.size.y, lidar.size.z) == pytest.approx((0.12, 0.12, 0.08))
    assert rigid(wheel.pose.position, wheel.pose.orientation)[:3, 2] == pytest.approx(
        [0.0, -1.0, 0.0], abs=1e-4
    )
    assert len(shown["base_link"].cubes) == 1 and shown["base_link"].cubes[0].size.y > 0.3
    colour = shown["lidar"].cylinders[0].color
    assert (colour.r, colour.g, colour.b) == pytest.approx((0.95, 0.62, 0.2))


def test_events_are_lines_of_the_log_and_objects(exported):
    (time, line), = exported["/log"]  # fmt: skip
    assert (line.message, line.name, line.level) == ("does it fit?", "localisation", 3)  # warning
    assert time == pytest.approx(1.5)
    found = next(item for _, item in exported["/events"] if item["kind"] == "doubt")
    assert found["fields"] == {"health": 0.25} and found["step"] == 30


def test_figures_and_the_tree_are_json(exported, recorded):
    for (_, status), (_, found), shot in zip(
        exported["/status"], exported["/localisation"], recorded, strict=True
    ):
        assert status["state"] == "running" and status["limitations"][0]["cause"] == "obstacle"
        assert found["health"] == pytest.approx(shot.health)
        assert found["error"] == pytest.approx(shot.pose.distance_to(shot.truth))
    _, tree = exported["/tree"][0]
    assert [row["depth"] for row in tree["nodes"]] == [0, 1, 1, 2, 3, 3, 3, 1]
    assert tree["nodes"][4]["name"] == "to the kitchen"
    assert exported["/compute"][0][1]["tree"] == {"mean": 1.0, "worst": 2.0}  # milliseconds
    assert exported["/battery"][0][1]["charge"] == pytest.approx(0.83)


def test_scans_lie_on_the_map_where_the_robot_was_at_their_stamps(tmp_path):
    """A real lidar that turns while the robot does: poses between two messages are interpolated.

    The walls are drawn 5 cm thick, the scan matcher's error is below 3 cm; at the pose of the
    newest message instead the ends of the beams are up to 0.2 m away.
    """
    mission = tmp_path / "m.yaml"
    mission.write_text(
        "mission: m\nrobot: scout\nworld: small_room\nstart: dock\nrun: {spin: {angle: 120 deg}}\n"
    )
    plan = diagnose(mission).plan
    execute(plan, RunOptions(serve=False, out=tmp_path / "run"))
    export_mcap(tmp_path / "run", tmp_path / "run.mcap")
    found = read(tmp_path / "run.mcap")
    times = np.array([time for time, _ in found["/tf"]])
    bases = [chain([message], "base")[0] for _, message in found["/tf"]]
    headings = np.unwrap([np.arctan2(base[1, 0], base[0, 0]) for base in bases])
    _, grid = found["/map"][0]
    cells = np.frombuffer(grid.data, np.uint8).reshape(-1, grid.column_count, 5)[..., 4]
    away = cv2.distanceTransform((cells != 100).astype(np.uint8), cv2.DIST_L2, 5)
    misses = []
    for _, scan in found["/scan"]:
        stamp = seconds(scan.timestamp)
        x, y = (np.interp(stamp, times, [base[axis, 3] for base in bases]) for axis in (0, 1))
        pose = Pose2D(x, y, np.interp(stamp, times, headings))
        ends = pose.transform(end_points(scan))
        at = (ends - (grid.pose.position.x, grid.pose.position.y)) / grid.cell_size.x
        column, row = np.clip(at.astype(int), 0, np.array(cells.shape)[::-1] - 1).T
        misses.append(np.median(away[row, column]) * grid.cell_size.x)
    assert headings[-1] - headings[0] > 1.5 and len(misses) > 10
    assert max(misses) < 0.06


def test_a_run_without_sensors_or_end_is_exported_up_to_where_it_is(folder, tmp_path):
    """A killed run has no end of its recording, and a live one grows."""
    (tmp_path / SNAPSHOTS).write_bytes((folder / SNAPSHOTS).read_bytes()[:200_000])
    export_mcap(tmp_path, tmp_path / "cut.mcap")
    found = read(tmp_path / "cut.mcap")
    assert 0 < len(found["/pose"]) < STEPS // 4 and "/sensors/lidar" not in found


def test_a_damaged_record_leaves_no_file(folder, tmp_path):
    whole = bytearray((folder / SNAPSHOTS).read_bytes())
    middle = len(whole) // 2
    whole[middle : middle + 4000] = bytes(4000)
    (tmp_path / SNAPSHOTS).write_bytes(whole)
    with pytest.raises(InputError, match="is damaged"):
        export_mcap(tmp_path, tmp_path / "run.mcap")
    assert [item.name for item in tmp_path.iterdir()] == [SNAPSHOTS]


def test_a_full_disk_is_an_error_and_leaves_no_file(folder, tmp_path):
    """A limit on the size of files stands for the disk."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, limits[1]))
    try:
        with pytest.raises(OSError, match=r"File too large: .*run\.mcap"):
            export_mcap(folder, tmp_path / "run.mcap")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, ignored)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere", "--mcap"], "there is no run 'nowhere'"),
        (["{folder}"], "give --mcap"),
        (["{folder}", "--mcap", "-o", "{folder}/snapshots.mcap"], "is a record of the run"),
        (["{folder}", "--mcap", "-o", "/nowhere/at/all.mcap"], "No such file or directory"),
    ],
)
def test_wrong_arguments_are_refused(folder, arguments, said):
    words = ["export", *(word.format(folder=folder) for word in arguments)]
    result = CliRunner().invoke(app, words)
    assert result.exit_code != 0 and said in str(result.exception)


def test_the_command_lists_the_topics(folder, tmp_path, recorded):
    result = CliRunner().invoke(
        app, ["export", str(folder), "--mcap", "-o", str(tmp_path / "run.mcap")]
    )
    assert result.exit_code == 0, result.exception
    rows = [line.split() for line in result.output.splitlines()]
    assert rows[0] == ["TOPIC", "SCHEMA", "MESSAGES"]
    assert ["/pose", "foxglove.PoseInFrame", str(len(recorded))] in rows
    assert ["/tree", "treepilot.tree"] in [row[:2] for row in rows]


def panels(content):
    """The panels of a layout, with their settings."""
    for item in content.get("items", ()):
        yield from panels(item["content"])
    if content["type"] == "panel":
        yield content["panelType"], content["config"]


def leaf(exported, path):
    """The values at a path of messages, as in /topic.field.field."""
    topic, *names = path.split(".")
    for _, message in exported[topic]:
        for name in names:
            message = message[name]
        yield message


def test_the_layout_shows_topics_and_fields_that_a_run_has(exported, folder, tmp_path):
    words = ["--mcap", "-o", str(tmp_path / "a.mcap"), "--layout", str(tmp_path / "l.json")]
    assert CliRunner().invoke(app, ["export", str(folder), *words]).exit_code == 0
    found = list(panels(json.loads((tmp_path / "l.json").read_text())["content"]))
    assert {kind for kind, _ in found} == {"ThreeDee", "StateTransitions", "Plot", "Log"}
    shown = [topic for _, config in found for topic in config.get("topics") or ()]
    assert set(shown) <= exported.keys() and len(shown) == 11
    for _, config in found:
        for series in config.get("paths") or ():
            for value in leaf(exported, series["value"]):
                if label := series.get("dynamicLabelField"):
                    assert all({label, series["dynamicValueField"]} <= row.keys() for row in value)
                else:
                    assert isinstance(value, float | str)


def test_without_the_library_the_command_says_how_to_install_it(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(type(FOXGLOVE), "is_installed", False)
    with pytest.raises(InputError, match=r"pip install 'treepilot\[foxglove\]'"):
        export_mcap(folder, tmp_path / "run.mcap")
