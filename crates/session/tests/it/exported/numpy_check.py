"""Checks the functions of the exported module law.py on arrays.

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

# Modules of the same name follow each other within a second, and law.so would be found before law.py.
sys.dont_write_bytecode = True
spec = importlib.util.spec_from_file_location("law", "law.py")
law = importlib.util.module_from_spec(spec)
spec.loader.exec_module(law)

BATCH = 7
random = numpy.random.default_rng(3)
x = random.uniform(-0.8, 0.8, (law.N, BATCH))
u = random.uniform(-2.0, 2.0, (law.U, BATCH))
p = {name: value if name.startswith("_") else value * random.uniform(0.9, 1.1, BATCH) for name, value in law.PARAMETERS.items()}


def check(what, found, wanted, tolerance=1e-12):
    found, wanted = numpy.asarray(found), numpy.asarray(wanted)
    same = numpy.isclose(found, wanted, rtol=tolerance, atol=tolerance, equal_nan=True)
    if found.shape != wanted.shape or not same.all():
        sys.exit("%s: %s of shape %s is not %s of shape %s" % (what, found, found.shape, wanted, wanted.shape))


# A batch gives what its members give one by one, which are numbers.
one = [{name: value if name.startswith("_") else float(value[k]) for name, value in p.items()} for k in range(BATCH)]
for function in (law.rates, law.outputs, law.jacobian):
    rows = [function(0.3, [float(v) for v in x[:, k]], [float(v) for v in u[:, k]], one[k]) for k in range(BATCH)]
    check(function.__name__, function(0.3, x, u, p), numpy.moveaxis(numpy.array(rows), 0, -1))

# A solver of scipy gives what the module simulates, with its own steps.
times = numpy.linspace(0.0, 0.5, 51)
inputs = [numpy.full(51, 0.5 + 0.3 * i) for i in range(law.U)]
start = {name: 0.05 - 0.02 * i for i, name in enumerate(law.STATES)}
at = law.input_function(times, inputs)
if not hasattr(law, "E"):
    fixed = dict(law.PARAMETERS, _implicit=False, _substeps=64)
    simulated = law.simulate(times, inputs, start, fixed)
    found = solve_ivp(
        lambda t, x: law.rates(t, x, at(t), fixed),
        (0.0, 0.5),
        list(start.values()),
        method="DOP853",
        t_eval=times,
        rtol=1e-10,
        atol=1e-12,
        vectorized=True,
    )
    check("solve_ivp", [law.outputs(t, x, at(t), fixed) for t, x in zip(found.t, found.y.T)], simulated, 1e-6)
print("checked")
