"""Send a file to a line that `nrdf serve` runs, wait, and fetch its programs.

    python examples/line_client.py http://127.0.0.1:8088 chair-1.ply [TOKEN]

Plain HTTP and JSON, nothing but the standard library: a PLC or a ROS 2 node asks the same way.
"""

import json
import sys
import time
import urllib.parse
import urllib.request
from pathlib import Path

server, file, *token = sys.argv[1:]
headers = {"Authorization": f"Bearer {token[0]}"} if token else {}


def ask(path, body=None):
    request = urllib.request.Request(server + path, body, headers)
    with urllib.request.urlopen(request) as answer:
        return answer.read()


name = urllib.parse.quote(Path(file).name)
job = json.loads(ask(f"/jobs?name={name}", Path(file).read_bytes()))
while job["state"] in ("waiting", "running"):
    time.sleep(1)
    job = json.loads(ask(f"/jobs/{job['id']}"))
print(f"{job['state']}: {job['reason'] or 'all limits are met'}")
for program in json.loads(ask(f"/jobs/{job['id']}/programs")):
    Path(Path(program).name).write_bytes(ask(f"/jobs/{job['id']}/programs/{program}"))
    print(f"wrote {Path(program).name}")
sys.exit(0 if job["state"] == "done" else 1)
