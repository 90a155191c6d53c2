"""Transfer the processes of one chair to another: tool paths and their metrics, in job/.

python examples/05_transfer_a_process.py
"""

import nrdf
from nrdf.bundled import KNOWLEDGE, bundled_chair

process = nrdf.load_process(KNOWLEDGE)  # chair.yaml: five regions of a reference, a process on each
target, _ = bundled_chair("rocker")  # PointCloud, 8192 points in metres

result = process.transfer(target)  # finds the regions, plans or warps the tool paths
for step in result.paths:  # in the order in which they are run
    if step.path is None:
        print(f"{step.region:11s} {step.process.label:15s} left out: {step.reason}")
    else:
        # step.path.segments: positions (n, 3) in metres, quaternions_xyzw (n, 4), feed, force
        print(
            f"{step.region:11s} {step.process.label:15s} {len(step.path.segments):4d} segments, "
            f"{step.metrics.coverage:.1%} covered, {step.metrics.cycle_time_s:.0f} s"
        )
nrdf.write_job("job", result, overwrite=True)  # as `nrdf transfer` does; then: nrdf export job …
