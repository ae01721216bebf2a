"""The protocol of a peer: after three calls to warm up it writes `ready`; then, for each line with a number
of calls, one line of JSON with wall and CPU seconds a call and the peak resident memory."""
import json
import resource
import sys
import time


def serve(call):
    for _ in range(3):
        call()
    print("ready", flush=True)
    for line in sys.stdin:
        calls = int(line)
        cpu, wall = time.process_time(), time.perf_counter()
        for _ in range(calls):
            call()
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(json.dumps({"wall_s": wall / calls, "cpu_s": cpu / calls, "rss_mb": memory}), flush=True)
