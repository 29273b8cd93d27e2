"""A mission of a thousand nodes, for measuring how long reading and checking take."""

HEADER = """mission: large
robot: scout
world: office
arguments: {dwell: {type: duration, default: 3 s}}
blackboard: {visited: {type: int, initial: 0}}
run:
  sequence:
"""

VISIT = """    - name: visit NUMBER
      timeout: 5 min
      fallback:
        - sequence:
            - check: battery.charge > 20 % and not battery.charging
            - navigate_to_pose: {goal: $dock, tolerance: 30 cm}
              retry: {attempts: 3, delay: 500 ms}
            - {wait: $dwell, when: $visited < 10}
            - set: {visited: $visited + 1}
            - say: arrived
        - {say: gave up, while: pose.distance_to($dock) > 1 m}
"""
NODES_OF_A_VISIT = 8


def large_mission(nodes: int) -> str:
    """The text of a mission of at least this many nodes, modifiers not counted."""
    visits = -(-(nodes - 1) // NODES_OF_A_VISIT)
    return HEADER + "".join(VISIT.replace("NUMBER", str(n + 1)) for n in range(visits))
