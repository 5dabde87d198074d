"""How the comparison runs programs and writes tables."""
import csv
import json
import os
import statistics
import subprocess


def run(command, threads, what):
    """The JSON objects that a program prints. It sees `threads` processors, and is told so."""
    environment = dict(os.environ, RAYON_NUM_THREADS=str(threads), OMP_NUM_THREADS=str(threads),
                       OPENBLAS_NUM_THREADS=str(threads), MKL_NUM_THREADS=str(threads))
    # Some machines pin OpenBLAS to the kernels of an old processor; the peers get the best there is.
    for name in ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE"):
        environment.pop(name, None)
    processors = sorted(os.sched_getaffinity(0))[:threads]
    try:
        done = subprocess.run(command, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              preexec_fn=lambda: os.sched_setaffinity(0, processors))
    except FileNotFoundError:
        print(f"{what}: {command[0]} is not there; run scripts/peers/install", flush=True)
        return []
    lines = objects(done.stdout)
    if not lines and done.returncode:
        print(f"{what}: nothing came out; {done.stderr.strip()[-300:]}", flush=True)
    return lines


def objects(text):
    """The one JSON object that a text is, or those at the end of its lines; the rest is chatter."""
    try:
        return [json.loads(text)]
    except json.JSONDecodeError:
        return [json.loads(line[line.index('{"'):]) for line in text.splitlines() if '{"' in line]


def summary(values):
    """Median, and half the distance between the quartiles as a share of it."""
    median = statistics.median(values)
    if len(values) < 2:
        return median, 0.0
    low, _, high = statistics.quantiles(values, n=4, method="inclusive")
    return median, (high - low) / 2 / median if median > 0 else 0.0


def write(path, header, rows):
    """PATH.csv and PATH.md."""
    with open(f"{path}.csv", "w", newline="") as file:
        csv.writer(file).writerows([header, *rows])
    with open(f"{path}.md", "w") as file:
        file.write("| " + " | ".join(header) + " |\n|" + "---|" * len(header) + "\n")
        for row in rows:
            file.write("| " + " | ".join(str(value) for value in row) + " |\n")
    print(open(f"{path}.md").read())
