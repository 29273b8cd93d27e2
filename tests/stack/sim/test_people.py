"""People who walk by social forces, on recorded tracks, and what they do on touching a robot."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from robots.load import read_robot
from robots.simulated import SimulatedBody
from stack.errors import InputError
from stack.sim.people import People
from stack.sim.people.bumps import Bump
from stack.sim.people.impatience import (
    BACK_AFTER,
    SQUEEZE_AFTER,
    SQUEEZE_WEIGHT,
    Impatience,
)
from stack.sim.people.social_force import SocialForcePeople
from stack.sim.worlds.people import read_tracks
from stack.sim.worlds.world import Door, Person, Wall, World
from stack.sim.worlds.world_file import read_world
from stack.types import Pose2D, Twist
from tests.stack.sim.sim_rover import EMPTY, ROVER, drive

PERIOD = 0.01
ROBOTS = Path(__file__).parents[3] / "robots"
FAR = [(Pose2D(90.0, 90.0), 0.3)]


def room(*people: Person, doors: tuple[Door, ...] = (), width: float = 8.0) -> World:
    """A hall of 12 m, divided in the middle by a wall with a door of 1 m."""
    outer = np.array([[0.0, 0.0], [12.0, 0.0], [12.0, width], [0.0, width], [0.0, 0.0]])
    walls = (
        Wall(outer),
        Wall(np.array([[6.0, 0.0], [6.0, width / 2 - 0.5]])),
        Wall(np.array([[6.0, width / 2 + 0.5], [6.0, width]])),
    )
    return World("hall", (-0.5, -0.5, 12.5, width + 0.5), walls, people=people, doors=doors)


def walker(name: str, *points: tuple[float, float], **more) -> Person:
    return Person(name, np.array(points), **{"speed": 1.3, "model": "social_force", **more})


def walk(people: People, seconds: float, robots=FAR, doors=None) -> np.ndarray:
    """Let people walk; return their positions (steps, n, 2)."""
    trail = []
    for _ in range(round(seconds / PERIOD)):
        people.walk(PERIOD, robots, doors)
        trail.append(people.all_places[:, :2].copy())
    return np.array(trail)


def test_alone_one_walks_at_the_wanted_speed():
    # The relaxation time is 0.5 s: after 2 s the speed is within 1 - exp(-4) = 98 % of the wanted.
    world = World("field", (0.0, 0.0, 40.0, 10.0), people=(walker("a", (2, 5), (38, 5)),))
    trail = walk(People(world, 0), 10.0)
    speeds = np.hypot(*np.diff(trail[200:, 0], axis=0).T) / PERIOD
    assert speeds.mean() == pytest.approx(1.3, rel=0.03)


def test_ways_lead_through_doors_and_keep_off_the_walls():
    people = People(room(walker("a", (2.0, 1.0), (10.0, 1.0))), 0)
    (trail,) = walk(people, 12.0).transpose(1, 0, 2)
    assert trail[:, 0].max() > 9.6  # 11.3 m by way of the door
    crossing = trail[np.argmin(np.abs(trail[:, 0] - 6.0))]
    assert abs(crossing[1] - 4.0) < 0.25
    assert trail[:, 1].min() > 0.25  # 5 cm of wall and 20 cm of body


def test_a_closed_door_stops_them():
    door = Door("middle", (6.0, 3.5), (6.0, 4.5))
    people = People(room(walker("a", (2.0, 4.0), (10.0, 4.0)), doors=(door,)), 0)
    closed = walk(people, 6.0, doors={"middle": True})
    assert closed[:, 0, 0].max() < 6.0 - 0.2
    assert walk(people, 8.0, doors={"middle": False})[:, 0, 0].max() > 9.0


@pytest.mark.parametrize("seed", range(3))
def test_oncoming_people_pass_each_other_without_overlap(seed):
    corridor = World(
        "corridor", (0.0, 0.0, 14.0, 2.0), (
            Wall(np.array([[0.0, 0.2], [14.0, 0.2]])), Wall(np.array([[0.0, 1.8], [14.0, 1.8]])),
        ), people=(walker("a", (1.0, 1.0), (13.0, 1.0)), walker("b", (13.0, 1.0), (1.0, 1.0))),
    )  # fmt: skip
    trail = walk(People(corridor, seed), 15.0)
    assert trail[:, 0, 0].max() > 12.5 and trail[:, 1, 0].min() < 1.5
    apart = np.hypot(*(trail[:, 0] - trail[:, 1]).T)
    assert apart.min() > 0.4 - 1e-3  # two radii of 20 cm


@pytest.mark.parametrize(("attention", "nearest"), [(1.0, (0.49, 2.0)), (0.0, (0.0, 0.3))])
def test_who_watches_the_robot_goes_round_it(attention, nearest):
    world = World(
        "field", (0.0, 0.0, 12.0, 8.0),
        people=(walker("a", (1.0, 4.0), (11.0, 4.0), attention=attention),),
    )  # fmt: skip
    trail = walk(People(world, 0), 9.0, [(Pose2D(6.0, 4.05), 0.3)])
    least = np.hypot(*(trail[:, 0] - (6.0, 4.05)).T).min()
    assert nearest[0] <= least <= nearest[1]
    assert trail[:, 0, 0].max() > 10.6


def test_a_group_stays_together():
    def spread(group: str) -> float:
        start = [(2.0, 1.0), (2.0, 7.0), (1.0, 4.0)]
        members = [
            walker(str(n), at, (30.0, 4.0), group=group, speed=speed)
            for n, (at, speed) in enumerate(zip(start, (1.0, 1.2, 1.4), strict=True))
        ]
        trail = walk(People(World("field", (0, 0, 32, 8), people=(*members,)), 0), 14.0)
        return float(np.hypot(*(trail[-1] - trail[-1].mean(axis=0)).T).max())

    assert spread("tour") < 1.5 < 2.4 < spread("")  # without it 0.4 m/s apart for 14 s


def test_the_same_seed_gives_the_same_walk_and_another_seed_another():
    world = room(walker("a", (1, 1), (11, 7), attention=0.5), walker("b", (11, 7), (1, 1)))
    first, again, other = (walk(People(world, seed), 5.0) for seed in (3, 3, 4))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_who_touches_a_robot_stops_and_goes_on_later():
    bump = Bump()
    shares = [bump.share(PERIOD, 0.01) for _ in range(1000)]
    # At 1 m/s: 0.2 s of stopping is a push by 10 cm, at most five times in 10 s.
    assert 0.05 < sum(shares[:220]) * PERIOD < 0.13
    assert sum(shares) * PERIOD < 0.65
    assert Bump().share(PERIOD, None) == 1.0


def test_who_presses_a_robot_against_something_steps_back_and_stands():
    bump = Bump()
    assert bump.share(PERIOD, 0.01) > 0.9
    assert bump.share(PERIOD, 0.03) == -1.0
    shares = [bump.share(PERIOD, None) for _ in range(270)]
    assert shares[:49] == [-1.0] * 49  # for half a second
    assert shares[51:240] == [0.0] * 189  # for two seconds
    assert shares[-1] > 0.0


@pytest.mark.parametrize("model", ["loop", "social_force"])
def test_a_person_who_touches_a_robot_stops_within_14_cm(model):
    people = walking_ahead(model)
    ((x, _),) = touching(people, 0.01, 0.3)
    # 1.3 m/s that falls to 0 within 0.2 s: 13 cm at most, less as the fall begins at once.
    assert 0.06 < x < 0.14
    ((x, _),) = touching(people, 0.01, 1.0)
    assert abs(x) < 0.01  # stands


@pytest.mark.parametrize("model", ["loop", "social_force"])
def test_a_person_who_presses_a_robot_against_something_steps_back(model):
    people = walking_ahead(model)
    ((x, y),) = touching(people, 0.03, PERIOD) + touching(people, None, 0.5 - PERIOD)
    assert x == pytest.approx(-0.5 * 1.3, abs=0.05)  # half a second at the speed of walking
    assert abs(y) < 0.05


def walking_ahead(model: str) -> People:
    """A person who has walked for two seconds along x."""
    person = walker("a", (2, 5), (38, 5), model=model, yields=False, attention=0.0)
    people = People(World("field", (0.0, 0.0, 40.0, 10.0), people=(person,)), 0)
    walk(people, 2.0)
    return people


def touching(people: People, depth: float | None, seconds: float) -> np.ndarray:
    """How far people get (n, 2) who overlap a robot just ahead of them by a depth."""
    before = people.all_places[:, :2].copy()
    x, y = before[0]
    robot = [(Pose2D(x + 0.6, y), 0.22)]
    for _ in range(round(seconds / PERIOD)):
        people.walk(PERIOD, robot, None, touched={} if depth is None else {"a": depth})
    return people.all_places[:, :2] - before


def standing(body: SimulatedBody, seconds: float) -> tuple[list[float], list[float], list[float]]:
    """True x, speed and tilt of a robot that is to stand, every 50 ms; closes it."""
    places, speeds, tilts = [], [], []
    try:
        for _ in range(round(seconds / 0.05)):
            drive(body, Twist(), 0.05)
            truth = body.truth
            places.append(truth.pose.x)
            speeds.append(float(np.hypot(truth.twist.linear, truth.twist.lateral)))
            tilts.append(body._robot.physics.tilt)
    finally:
        body.close()
    return places, speeds, tilts


@pytest.mark.parametrize("model", ["loop", "social_force", "recorded"])
@pytest.mark.parametrize("heading", [0.0, 0.8, 1.57])
def test_nobody_presses_a_robot_into_a_wall_out_of_which_it_is_thrown(model, heading):
    """The physics would part bodies that overlap by 10 cm at 2 to 7 m/s."""
    way = np.array([[0.0, 0.0], [2.3 if model == "social_force" else 8.0, 0.0]])
    track = np.array([[0.0, 0.0, 0.0, 1.3, 0.0], [6.0, 7.8, 0.0, 1.3, 0.0]])
    person = Person("Ada", way, speed=1.3, yields=False, model=model, attention=0.0)
    if model == "recorded":
        person = Person("Ada", way, model=model, track=track, recorded_duration=6.0)
    wall = Wall(np.array([[2.6, -3.0], [2.6, 3.0]]))
    world = replace(EMPTY, people=(person,), walls=(wall,))
    body = SimulatedBody(ROVER, world, start=Pose2D(2.0, 0.0, heading), seed=0)
    places, speeds, _ = standing(body, 5.0)
    assert 2.0 <= max(places) < 2.6
    assert max(speeds) < 1.4  # the walking speed


@pytest.mark.parametrize(("robot", "heading"), [("scout", 0.0), ("scout", 1.57), ("jackal", 2.6)])
def test_nobody_tips_a_robot_over_that_stands_before_a_wall(robot, heading):
    """Who walks into it again and again would lift it by 30 degrees, and make it fall at 3 m/s."""
    person = Person("Ada", np.array([[0.0, 0.0], [8.0, 0.1]]), speed=1.3, yields=False)
    wall = Wall(np.array([[2.6, -3.0], [2.6, 3.0]]))
    described = read_robot(ROBOTS / robot / "robot.yaml")
    world = replace(EMPTY, people=(person,), walls=(wall,))
    body = SimulatedBody(described, world, start=Pose2D(2.0, 0.0, heading), seed=0)
    _, speeds, tilts = standing(body, 30.0)
    assert max(tilts) < np.radians(3.0)
    assert max(speeds) < 1.3  # the walking speed


def test_somebody_who_does_not_yield_pushes_a_robot_but_does_not_drag_it_along():
    person = Person("Ada", np.array([[0.0, 0.0], [8.0, 0.0]]), speed=1.0, yields=False)
    body = SimulatedBody(
        ROVER, replace(EMPTY, people=(person,)), start=Pose2D(2.0, 0.0, 1.57), seed=0
    )
    try:
        drive(body, Twist(), 8.0)  # without resistance Ada would be 8 m away
        moved = body.truth.pose.x - 2.0
    finally:
        body.close()
    assert 0.02 < moved < 0.6


TRACK = "".join(f"{10 * n} 1 {0.4 * n} {2.0}\n{10 * (n + 5)} 7 3 {0.2 * n}\n" for n in range(11))


def test_recorded_tracks_are_walked_as_recorded(tmp_path):
    file = tmp_path / "tracks.txt"
    file.write_text("# frame number x y\n" + TRACK)
    tracks = read_tracks(file, 25.0, Pose2D(1.0, 0.0, np.pi / 2))
    assert sorted(tracks) == [1, 7]
    # 100 frames are 4 s at 1 m/s along x, which is y of a frame that is turned by 90 degrees.
    assert tracks[1][0] == pytest.approx([0.0, -1.0, 0.0, 0.0, 1.0], abs=1e-9)
    assert tracks[1][-1, :3] == pytest.approx([4.0, -1.0, 4.0], abs=1e-9)
    world = World("field", (-5, -5, 9, 9), people=tuple(
        Person(f"r {n}", track[:, 1:3], model="recorded", track=track, recorded_duration=6.0)
        for n, track in tracks.items()
    ))  # fmt: skip
    people = People(world, 5)
    trail = walk(people, 12.0)
    # It begins again after 6 s.
    assert trail[:600] == pytest.approx(trail[600:], abs=1e-6, nan_ok=True)
    there = ~np.isnan(trail[:, :, 0])
    assert there.sum(axis=0) * PERIOD == pytest.approx([8.0, 8.0], abs=0.06)  # twice 4 s each
    steps = np.diff(trail[:, 0], axis=0)
    speeds = np.hypot(*steps[~np.isnan(steps[:, 0])].T) / PERIOD
    assert speeds == pytest.approx(1.0, abs=1e-6)
    assert len(people.places) == there[-1].sum()


def test_the_seed_decides_where_a_recording_begins(tmp_path):
    file = tmp_path / "tracks.txt"
    file.write_text(TRACK)
    track = read_tracks(file, 25.0, Pose2D(0.0, 0.0))[1]
    person = Person("r", track[:, 1:3], model="recorded", track=track, recorded_duration=6.0)
    world = World("field", (-5, -5, 9, 9), people=(person,))
    starts = {tuple(People(world, seed).all_places[0].tolist()) for seed in range(6)}
    assert len(starts) > 3


@pytest.mark.parametrize(("x", "first"), [(3.4, 0.0), (1.0, 3.0), (0.0, 2.0)])
def test_a_recorded_person_appears_at_a_distance_from_robots(tmp_path, x, first):
    """Tracks begin anywhere: also where a robot stands, which the physics would throw away."""
    file = tmp_path / "tracks.txt"
    file.write_text(TRACK)
    track = read_tracks(file, 25.0, Pose2D(0.0, 0.0))[1]  # from x = 0 to 4 at 1 m/s, y = 2
    person = Person("r", track[:, 1:3], model="recorded", track=track, recorded_duration=4.5)
    world = World("field", (-5, -5, 9, 9), people=(person,))
    robots = [(Pose2D(x, 2.0), 0.3)]
    trail = walk(People(world, 2, robots), 12.0, robots)[:, 0, 0]
    appears = np.flatnonzero(np.isnan(trail[:-1]) & ~np.isnan(trail[1:])) + 1
    # Radii of 0.3 and 0.2 m, and 1.5 m between the surfaces; a step is 1 cm.
    assert len(appears) >= 2
    assert trail[appears] == pytest.approx(first, abs=0.011)
    assert np.nanmax(trail) == pytest.approx(4.0, abs=0.011)  # then nothing stops them


def test_nobody_appears_inside_a_robot_at_time_0(tmp_path):
    file = tmp_path / "tracks.txt"
    file.write_text(TRACK)
    track = read_tracks(file, 25.0, Pose2D(0.0, 0.0))[1]
    person = Person("r", track[:, 1:3], model="recorded", track=track, recorded_duration=4.0)
    world = replace(EMPTY, people=(person,))
    x, y = People(world, 3).positions[0]
    body = SimulatedBody(ROVER, world, start=Pose2D(x, y), seed=3)
    for _ in range(20):
        body.wait(0.05)
    # 0.2 m of an overlap would throw the robot at metres per second.
    assert body.truth.pose.distance_to(Pose2D(x, y)) < 0.01
    body.close()


WORLD = """world: w
format: 1
start: [1, 1, 0]
walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4]], closed: true}]
people:
  - %s
"""


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        ("{name: a, model: social_forse, waypoints: [[1, 1], [2, 2]]}", "social_force"),
        ("{name: a, waypoints: [[1, 1]]}", "at least two points"),
        ("{name: a, model: social_force, waypoints: []}", "at least one point"),
        ("{name: a, waypoints: [[1, 1], [2, 2]], group: g}", "'group' has no effect with model"),
        ("{name: a, model: recorded}", "a recording needs its track"),
        ("{name: a, model: recorded, track: none.txt}", "No such file"),
        ("{name: a, model: recorded, track: bad.txt}", "line 2: expected frame, number, x and y"),
        ("{name: a, model: recorded, track: empty.txt}", "the file has no tracks"),
        ("{name: a, model: recorded, track: one.txt}", "nobody in it has two samples"),
    ],
)
def test_mistakes_in_people_are_explained(tmp_path, entry, sentence):
    (tmp_path / "bad.txt").write_text("0 1 2 3\n10 1 x 3\n")
    (tmp_path / "empty.txt").write_text("# nothing\n")
    (tmp_path / "one.txt").write_text("0 1 2 3\n")
    file = tmp_path / "w.yaml"
    with pytest.raises(InputError) as caught:
        read_world(file, WORLD % entry)
    assert sentence in str(caught.value)


def test_a_recording_in_a_world_file_is_all_its_people(tmp_path):
    (tmp_path / "tracks.txt").write_text(TRACK)
    entry = "{name: r, model: recorded, track: tracks.txt, frame_rate: 25, at: [1, 1, 0]}"
    world = read_world(tmp_path / "w.yaml", WORLD % entry)
    assert [person.name for person in world.people] == ["r 1", "r 7"]
    assert {person.recorded_duration for person in world.people} == {6.0}


def corridor(width: float, *people: Person) -> World:
    outline = np.array([[0, 0], [16, 0], [16, width], [0, width], [0, 0]], dtype=np.float64)
    return World("corridor", (-0.5, -0.5, 16.5, width + 0.5), (Wall(outline),), people=people)


@pytest.mark.parametrize("width", [1.4, 1.6, 2.0])
def test_one_passes_a_robot_that_stands_in_the_middle_of_a_corridor(width):
    """1.4 m: 0.7 m less 0.22 m of robot leave 0.48 m at each side for 0.4 m of person."""
    people = People(corridor(width, walker("a", (1, width / 2), (15, width / 2))), 0)
    trail = walk(people, 12.0, [(Pose2D(8.0, width / 2), 0.22)])
    assert trail[:, 0, 0].max() > 10.0


def test_people_pass_each_other_as_far_apart_as_recorded_people_do():
    """Oncoming, within 1.5 m: 25 % pass closer than 0.74 m, half closer than 1.01 m.

    Measured in 210 pairs of the recording crowds_zara02 (A. Lerner et al., "Crowds by example",
    2007).
    """
    found: list[float] = []
    for seed in (0, 1):
        random = np.random.default_rng(seed)
        people = [
            Person(f"p{i}", random.uniform(1.0, 11.0, (4, 2)), random.uniform(0.7, 1.3),
                   model="social_force")
            for i in range(10)
        ]  # fmt: skip
        outer = np.array([[0.0, 0.0], [12.0, 0.0], [12.0, 12.0], [0.0, 12.0], [0.0, 0.0]])
        walkers = SocialForcePeople(people, World("hall", (-1, -1, 13, 13), (Wall(outer),)), seed)
        track = []
        for _ in range(2000):
            walkers.walk(0.05, [], {}, [None] * 10)
            track.append(walkers.places.copy())
        found += oncoming_distances(np.array(track))
    assert len(found) > 60
    assert np.percentile(found, [25, 50]) == pytest.approx([0.74, 1.01], abs=0.15)


def oncoming_distances(track: np.ndarray) -> list[float]:
    """Least distances within 2 s of pairs who walk against each other; track: (t, n, 2), 20 Hz."""
    found = []
    for a, b in combinations(range(track.shape[1]), 2):
        away = np.hypot(*(track[:, a] - track[:, b]).T)
        for k in range(40, len(away) - 40):
            if away[k] >= 1.5 or away[k] > away[k - 40 : k + 41].min():
                continue
            u, v = track[k + 10, [a, b]] - track[k - 10, [a, b]]  # metres in 1 s
            speeds = np.hypot(*u), np.hypot(*v)
            if min(speeds) > 0.5 and u @ v < -0.7 * speeds[0] * speeds[1]:
                found.append(float(away[k]))
    return found


def test_who_is_stuck_goes_close_to_walls_and_in_the_end_turns_back():
    impatience = Impatience(2, np.random.default_rng(0))
    wanted = np.array([[1.0, 0.0], [1.0, 0.0]])
    velocities = np.array([[0.0, 0.1], [0.9, 0.0]])
    for _ in range(round(SQUEEZE_AFTER / PERIOD) + 1):
        impatience.update(PERIOD, wanted, velocities)
    assert impatience.wall_weights.tolist() == [SQUEEZE_WEIGHT, 1.0]
    turned = 0.0
    while not impatience.turns_back[0]:
        impatience.update(PERIOD, wanted, velocities)
        turned += PERIOD
        assert turned < BACK_AFTER[1]
    assert turned + SQUEEZE_AFTER >= BACK_AFTER[0] - 2 * PERIOD
    assert not impatience.turns_back[1]


def test_four_people_and_a_robot_do_not_stand_in_a_corridor_for_ever():
    ways = [
        ((1, 0.7), (15, 0.7)),
        ((2, 0.7), (15, 0.7)),
        ((15, 0.7), (1, 0.7)),
        ((14, 0.7), (1, 0.7)),
    ]
    people = People(corridor(1.4, *(walker(f"p{n}", *way) for n, way in enumerate(ways))), 1)
    trail = walk(people, 60.0, [(Pose2D(8.0, 0.7), 0.3)])
    for still in range(10, 60, 10):
        part = trail[still * 100 : still * 100 + 1000]
        assert np.ptp(part, axis=0).max() > 0.5


@pytest.mark.parametrize("seed", range(3))
def test_a_crowd_does_not_press_who_watches_a_robot_against_it(seed):
    corners = [(1.0, 1.0), (5.0, 3.0), (5.0, 1.0), (1.0, 3.0)]
    outer = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0], [0.0, 0.0]])
    people = tuple(
        walker(str(n), corners[n % 4], corners[(n + 1) % 4], start=n / 8) for n in range(8)
    )
    world = World("room", (-0.5, -0.5, 6.5, 4.5), (Wall(outer),), people=people)
    trail = walk(People(world, seed), 20.0, [(Pose2D(3.0, 2.0), 0.22)])
    away = np.hypot(trail[..., 0] - 3.0, trail[..., 1] - 2.0)
    # Radii of 0.2 and 0.22 m: without slowing down the least distance is 0.418 to 0.42 m.
    assert away.min() > 0.422
