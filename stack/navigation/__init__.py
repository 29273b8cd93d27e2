"""Navigation: plans, follows, checks progress and recovers; the robot that behaviours see."""
