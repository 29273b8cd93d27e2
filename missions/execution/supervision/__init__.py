"""Supervisor and engine of a run: two processes that share a page of memory and a pipe.

launch      what `treepilot run` asks for; starts the supervisor
supervisor  parent: owns terminal and signals, prints the result; watches the engine
engine      child: builds and runs the missions
heartbeat   shared memory: the engine's progress, and the supervisor's requests
messages    pipe from the engine: start of a run, reports
viewer      the dashboard, a third process
lost_engine what is said and written about an engine that ended without a report
"""
