"""Missions as environments: Gymnasium's own checks, repeatable episodes, rewards, learning."""

from __future__ import annotations

import subprocess
import sys
import warnings
from hashlib import sha256
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

from stack.errors import InputError
from treepilot.gym import ENVIRONMENT, MissionEnv

ROOT = Path(__file__).parents[3]
POINT = "01_drive_to_a_point"


@pytest.fixture
def made():
    """A function that makes environments, which are closed at the end."""
    environments = []

    def make(*arguments, **settings):
        environments.append(MissionEnv(*arguments, **settings))
        return environments[-1]

    yield make
    for env in environments:
        env.close()


def wander(env, seed, steps):
    """The hash of all that an episode with random actions gives."""
    digest, actions = sha256(), np.random.default_rng(4)
    observed, _ = env.reset(seed=seed)
    for _ in range(steps):
        digest.update(np.ascontiguousarray(observed).tobytes())
        least, most = env.action_space.low, env.action_space.high
        observed, reward, over, late, facts = env.step(
            actions.uniform(least, most).astype(np.float32)
        )
        digest.update(repr((reward, over, late, facts["time"], facts["distance"])).encode())
        if over or late:
            break
    return digest.hexdigest()


def test_gymnasium_finds_nothing_wrong():
    env = gymnasium.make(ENVIRONMENT, mission=POINT, render_mode="rgb_array", actions="normalised")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)  # its render check wants a human mode
    env.reset(seed=1)
    picture = env.render()
    assert picture.ndim == 3 and picture.shape[2] == 3 and picture.dtype == np.uint8
    blue = (picture.reshape(-1, 3) == (120, 200, 255)).all(axis=1).sum()
    assert blue > 100  # the outline of the robot
    assert env.metadata["render_fps"] == 20.0
    env.close()


def test_the_same_seed_gives_the_same_episode(made):
    one = made(POINT, flat=True, observations=["ranges", "path", "command"], actions="normalised")
    first = wander(one, 7, 40)
    assert wander(one, 8, 40) != first
    assert wander(one, 7, 40) == first
    other = made(POINT, flat=True, observations=["ranges", "path", "command"], actions="normalised")
    assert wander(other, 7, 40) == first


def test_episodes_without_a_seed_go_on_with_a_sequence(made):
    env = made(world="small_room", flat=True)
    seeds = [env.reset(seed=3)[1]["seed"], *(env.reset()[1]["seed"] for _ in range(2))]
    again = [env.reset(seed=3)[1]["seed"], *(env.reset()[1]["seed"] for _ in range(2))]
    assert seeds == again
    assert seeds[0] == 3 and len({*seeds}) == 3


@pytest.mark.slow
def test_vectors_of_environments_are_independent():
    """In one process and in several: each is as if it were alone."""

    def make():
        return MissionEnv(POINT, flat=True, actions="normalised")

    results = []
    for vector in (SyncVectorEnv([make] * 2), AsyncVectorEnv([make] * 2)):
        observed, _ = vector.reset(seed=11)  # 11 and 12
        digests = [sha256(one.tobytes()) for one in observed]
        for step in range(25):
            actions = np.array([[1.0, 0.3], [np.sin(step), -0.5]], np.float32)
            observed, rewards, _, _, _ = vector.step(actions)
            for digest, one, reward in zip(digests, observed, rewards, strict=True):
                digest.update(one.tobytes() + repr(float(reward)).encode())
        results.append([digest.hexdigest() for digest in digests])
        vector.close()
    alone = make()
    observed, _ = alone.reset(seed=12)
    digest = sha256(observed.tobytes())
    for step in range(25):
        observed, reward, _, _, _ = alone.step(np.array([np.sin(step), -0.5], np.float32))
        digest.update(observed.tobytes() + repr(float(reward)).encode())
    alone.close()
    assert results[0] == results[1]
    assert results[0][1] == digest.hexdigest()


def steer(observed):
    """Full speed ahead and turn to the second point of the path."""
    return np.array([min(0.5, observed["remaining"][0]), 1.6 * observed["path"][1, 1]], np.float32)


def episode(env, act, seed=1):
    """All rewards of an episode by term, and what its last step returned."""
    observed, facts = env.reset(seed=seed)
    terms, over, late = [], False, False
    while not (over or late):
        observed, reward, over, late, facts = env.step(act(observed))
        assert reward == pytest.approx(sum(facts["rewards"].values()))
        terms.append(facts["rewards"])
    total = {name: sum(term[name] for term in terms) for name in terms[0]}
    return total, over, late, facts


FOLLOWS = {"observations": ["path", "remaining"]}
NEAR = {"goal_checker.use": "simple_goal", "goal_checker.position": "0.25",
        "goal_checker.heading": "3.2"}  # fmt: skip


def test_rewards_of_a_success(made):
    """The way is 3.5 m along the path from (1, 1) to (3, 3.9), with at most 25 cm left."""
    env = made(POINT, **FOLLOWS, parameters=NEAR, arguments={"goal": "[3.0, 3.9, 0]"})
    total, over, late, facts = episode(env, steer)
    assert (over, late, facts["status"]) == (True, False, "success")
    assert total["success"] == 10.0 and total["failure"] == total["collision"] == 0.0
    assert total["time"] == pytest.approx(-0.1 * facts["time"], abs=0.1)
    assert 3.2 < total["progress"] < 3.9  # straight it is 3.52 m


def test_time_is_limited(made):
    env = made(POINT, **FOLLOWS, time_limit=3.0)
    total, over, late, facts = episode(env, lambda observed: np.zeros(2, np.float32))
    assert (over, late, facts["status"]) == (False, True, "running")
    assert facts["time"] == pytest.approx(3.0)
    assert total["progress"] == pytest.approx(0.0, abs=0.05)


def test_standing_still_fails_the_mission(made):
    """The progress checker gives 8 s."""
    total, over, _, facts = episode(made(POINT, **FOLLOWS), lambda _: np.zeros(2, np.float32))
    assert over and facts["status"] == "failure" and "NO_PROGRESS" in facts["reason"]
    assert total["failure"] == -10.0
    assert 8.0 < facts["time"] < 9.0


@pytest.mark.parametrize("safety", [True, False])
def test_safety_stops_what_drives_into_a_wall(made, safety):
    """Straight ahead from (1, 1) the table begins at x = 2.8."""
    env = made(POINT, safety=safety, collision_ends=True, time_limit=8.0)
    total, over, _, facts = episode(env, lambda _: np.array([0.8, 0.0], np.float32))
    assert facts["collisions"] == (0 if safety else 1)
    assert over is not safety
    assert total["collision"] == (0.0 if safety else -5.0)
    assert total["clearance"] < -0.1 if safety else total["clearance"] < 0.0


def test_pictures(made):
    env = made(POINT, observations=["image", "goal"], image_width=64)
    observed, _ = env.reset(seed=1)
    for _ in range(10):
        observed, *_ = env.step(np.array([0.0, 0.5], np.float32))
    assert observed["image"].shape == (48, 64, 3)
    assert observed["image"].std() > 10.0  # not one colour


def test_drives_are_drawn_where_there_is_room(made):
    env = made(world="office", robot="scout")
    for seed in range(5):
        env.reset(seed=seed)
        start, goal = env.run.engine.body.truth.pose, env.run.engine.runtime.parts.navigator.goal
        assert start.distance_to(goal) >= 1.0
        assert env.run.engine.runtime.perceived.obstacles.points.size > 0


def test_an_episode_has_its_own_start_and_arguments(made):
    env = made(POINT)
    env.reset(seed=1, options={"start": "plant", "arguments": {"goal": "[5, 1, 0]"}})
    runtime = env.run.engine.runtime
    assert runtime.parts.navigator.goal.x == 5.0
    assert abs(env.run.engine.body.truth.pose.y - 4.2) < 0.05
    with pytest.raises(InputError, match="there is no 'goal'; expected arguments or start"):
        env.reset(options={"goal": "dock"})
    with pytest.raises(
        InputError, match=r"start: expected a place or 'x,y,heading', got \(1, 2, 0\)"
    ):
        env.reset(options={"start": (1, 2, 0)})


@pytest.mark.parametrize("action", [np.zeros(3), 0.1, [np.nan, 0.0], [np.inf, 0.0], "left", None])
def test_a_wrong_action_is_refused_and_the_episode_goes_on(made, action):
    env = made(POINT)
    env.reset(seed=1)
    time = env.run.engine.body.time
    with pytest.raises(InputError, match=r"step: expected an action of Box\(.*, got "):
        env.step(action)
    assert env.run.engine.body.time == time
    env.step(np.zeros(2))


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"observations": ["scan"]}, "'scan' is not one of ranges, goal"),
        ({"observations": ["goal", "goal"]}, "a name is listed twice"),
        ({"observations": []}, "a policy observes nothing"),
        ({"observations": ["image"], "flat": True}, "is not flat; leave `flat` out"),
        ({"observations": ["image"], "robot": "scout_depth"}, "has no camera for the observation"),
        ({"sectors": 2}, "sectors: 2 must be at least 3"),
        ({"sector": 20}, "there is no parameter 'sector' here; did you mean 'sectors'"),
        ({"rewards": {"sucess": 1}}, "did you mean 'success'"),
        ({"actions": "torque"}, "'torque' is not one of velocity, normalised"),
        ({"time_limit": 0.0}, "expected more than 0 s"),
        ({"time_limit": float("nan")}, "expected more than 0 s, got nan"),
        ({"render_mode": "human"}, "'human' is not one of rgb_array"),
        ({"mission": None}, "an environment needs a mission or a world"),
        ({"mission": "50_pick_the_red_block"}, "does not drive"),
        ({"mission": "01_drive_to_a_pint"}, "did you mean"),
    ],
)
def test_wrong_settings_are_refused(settings, expected):
    with pytest.raises(InputError, match=expected):
        MissionEnv(**{"mission": POINT, **settings})


def test_a_mission_without_a_drive_has_nothing_to_learn(made, tmp_path):
    file = tmp_path / "wait.yaml"
    file.write_text("mission: wait\nrobot: scout\nworld: small_room\nrun:\n  wait: 1 s\n")
    with pytest.raises(InputError, match="it drives nowhere"):
        made(file).reset(seed=1)


def test_without_gymnasium_the_extra_is_named():
    code = "import sys; sys.modules['gymnasium'] = None; import treepilot.gym"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert "pip install 'treepilot[gym]'" in done.stderr


def test_gymnasium_finds_it_by_its_module():
    code = "import gymnasium; gymnasium.make('treepilot.gym:treepilot/Mission-v0', mission='x')"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert "no such mission file" in done.stderr


@pytest.mark.slow
def test_a_small_learner_improves(made):
    """Cross-entropy method (R. Rubinstein, 1999) on four weights: 18 episodes of at most 5 s."""
    env = made(
        POINT, observations=["path"], flat=True, actions="normalised", repeat=5, time_limit=5.0,
        path_points=1, path_spacing=0.8, rewards={"failure": 0.0},
    )  # fmt: skip
    rng = np.random.default_rng(1)
    mean, deviation, results = np.zeros(4), np.ones(4), []
    for _ in range(3):
        candidates = rng.normal(mean, deviation, (6, 4))
        returns = np.array([total_of(env, weights) for weights in candidates])
        best = candidates[np.argsort(returns)[-2:]]
        mean, deviation = best.mean(axis=0), best.std(axis=0) + 0.1
        results.append(returns.mean())
    assert results[-1] > results[0] + 0.5, results  # half a metre of way


def total_of(env, weights):
    """Return of an episode in which speed and turn depend linearly on a point of the path."""
    (ahead, aside), total, over = env.reset(seed=1)[0], 0.0, False
    while not over:
        speed, turn = weights[0] + weights[1] * ahead, weights[2] + 2.0 * weights[3] * aside
        action = np.clip([speed, turn], -1.0, 1.0).astype(np.float32)
        (ahead, aside), reward, ended, late, _ = env.step(action)
        total, over = total + reward, ended or late
    return total
