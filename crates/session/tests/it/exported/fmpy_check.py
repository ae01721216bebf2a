"""Simulates an FMU by fmpy: FILE KIND INPUTS.csv NAME=VALUE ...; prints the outputs at every second time of the file.

The inputs jump at the other times only, because fmpy reads outputs before it sets the inputs of a time.

Exits with code 77 where fmpy cannot be imported.
"""
import csv
import sys

try:
    import fmpy
    import fmpy.validation
    import numpy
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit(77)

file, kind, inputs, *start = sys.argv[1:]
problems = fmpy.validation.validate_fmu(file)
if problems:
    sys.exit("\n".join(problems))
description = fmpy.read_model_description(file, validate=True)
outputs = [v.name for v in description.modelVariables if v.causality == "output"]
with open(inputs, newline="") as table:
    header, *rows = csv.reader(table)
values = numpy.array([[float(cell) for cell in row] for row in rows])
signals = numpy.array([tuple(row) for row in values], dtype=[(name, "f8") for name in ["time"] + header[1:]])
times = values[::2, 0]
found = fmpy.simulate_fmu(
    file,
    fmi_type={"cs": "CoSimulation", "me": "ModelExchange"}[kind],
    start_values={name: float(value) for name, _, value in (word.rpartition("=") for word in start)},
    input=signals if len(header) > 1 else None,
    output=outputs,
    output_interval=times[1] - times[0],
    stop_time=times[-1],
    relative_tolerance=1e-9,
)
for time in times:
    row = numpy.flatnonzero(numpy.isclose(found["time"], time, rtol=0.0, atol=1e-9))
    if len(row) == 0:
        sys.exit("there are no outputs at t = %g s" % time)
    for name in outputs:
        print("%.17g" % found[name][row[0]])
