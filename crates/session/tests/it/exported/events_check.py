"""Simulates the exported module law.py by scipy, with its events: FORCE POSITION SPEED; prints the outputs.

Exits with code 77 where numpy or scipy cannot be imported.
"""
import importlib.util
import sys

try:
    import numpy
    from scipy.integrate import solve_ivp
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit(77)

sys.dont_write_bytecode = True
spec = importlib.util.spec_from_file_location("law", "law.py")
law = importlib.util.module_from_spec(spec)
spec.loader.exec_module(law)

force, *x = map(float, sys.argv[1:])
times = numpy.linspace(0.0, 1.0, 101)
u = law.input_function(times, [numpy.full(101, force)])
t, rows = 0.0, []
while len(rows) < len(times):
    left = times[len(rows):]
    found = solve_ivp(
        lambda t, x: law.rates(t, x, u(t), law.PARAMETERS),
        (t, times[-1]),
        x,
        method="DOP853",
        t_eval=left,
        events=law.crossings(u),
        rtol=1e-11,
        atol=1e-13,
        vectorized=True,
    )
    rows += [law.outputs(t, x, u(t), law.PARAMETERS) for t, x in zip(found.t, found.y.T)]
    for event, times_of_event in enumerate(found.t_events):
        if len(times_of_event) > 0:
            t = times_of_event[0]
            x = law.reset(event, t, found.y_events[event][0], u(t), law.PARAMETERS)
print("\n".join("%.17g" % value for row in rows for value in row))
