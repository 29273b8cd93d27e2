"""Motions of an arm: kinematics, collisions, planning, timing and grasps.

A library without simulation and step loop. An `ArmModel` is read once from the URDF and the
`ArmDescription`. A frozen `Scene` says what must not be touched. `ArmPlanner` plans paths between
positions, to poses and along straight lines, and times them; `grasps` proposes grasps of a block.
A body follows a trajectory by a `TrajectoryFollower`, and `braking` stops it on its path.

    model = ArmModel(Path("panda.urdf"), description)
    planner = ArmPlanner(model)
    waypoints = planner.plan_to_pose(positions, target, scene, stream(seed, "arm"))
    trajectory = planner.trajectory(waypoints, scene)

Positions are (n,), radians (metres of prismatic joints), in the order of the description. Poses
are (4, 4) in the arm's `base_link`. Pinocchio and coal (extra `arm`) are imported when a model is
read, and only in this package.
"""
