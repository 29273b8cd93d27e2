"""SLAM with a pose graph of keyframes.

`graph` holds the records (`Keyframe`, `Edge`, `PoseGraph`), `mapper.Mapper` builds them from scans
and odometry, `optimiser` (the only module that imports gtsam) moves the keyframes, `rendering`
draws the occupancy grid from them. `upkeep` decides which scans are kept. `global_localisation`
finds the robot on the drawn map; `estimator` has the estimators `slam` and `pose_graph`.
"""
