//! Templates of the exported programs of equation models; `@MARK@` stands for a text of the model.

pub(super) const PYTHON: &str = include_str!("system.py.txt");
pub(super) const PYTHON_EVENTS: &str = include_str!("events.py.txt");
pub(super) const PYTHON_MAIN: &str = include_str!("replay.py.txt");
pub(super) const C_HEADER: &str = include_str!("header.c.txt");
pub(super) const C: &str = include_str!("system.c.txt");
pub(super) const C_DELAYED: &str = include_str!("delays.c.txt");
pub(super) const C_UNDELAYED: &str = include_str!("undelayed.c.txt");
pub(super) const C_EVENTS: &str = include_str!("events.c.txt");
pub(super) const C_MAIN: &str = include_str!("replay.c.txt");

pub(super) const PYTHON_TABLES: &str = "

def table_piece(x, knots):
    \"\"\"Index of the knot before x; None outside the knots.\"\"\"
    after = bisect.bisect_right(knots, x)
    return after - 1 if 0 < after < len(knots) else None


def table(x, knots, values):
    if is_array(x):
        return numpy.interp(x, knots, values)
    i = table_piece(x, knots)
    if i is None:
        return x if x != x else values[0] if x < knots[0] else values[-1]
    return values[i] + (values[i + 1] - values[i]) * (x - knots[i]) / (knots[i + 1] - knots[i])


def table_slope(x, knots, values):
    if is_array(x):
        slopes = numpy.diff(values) / numpy.diff(knots)
        return numpy.concatenate([[0.0], slopes, [0.0]])[numpy.searchsorted(knots, x, side=\"right\")]
    i = table_piece(x, knots)
    return 0.0 if i is None else (values[i + 1] - values[i]) / (knots[i + 1] - knots[i])


";

pub(super) const C_TABLES: &str = "
static int law_table_piece(double x, int n, const double *knots) {
    int i = 0;
    while (i < n && knots[i] <= x) i++;
    return i > 0 && i < n ? i - 1 : -1;
}
static inline double law_table(double x, int n, const double *knots, const double *values) {
    int i = law_table_piece(x, n, knots);
    if (i < 0) return x != x ? x : x < knots[0] ? values[0] : values[n - 1];
    return values[i] + (values[i + 1] - values[i]) * (x - knots[i]) / (knots[i + 1] - knots[i]);
}
static inline double law_table_slope(double x, int n, const double *knots, const double *values) {
    int i = law_table_piece(x, n, knots);
    return i < 0 ? 0.0 : (values[i + 1] - values[i]) / (knots[i + 1] - knots[i]);
}
";

pub(super) const C_PLAIN_STEP: &str = "
static int law_step_once(law_state *state, const law_signal *signal, double t, double h, const law_parameters *p) {
    double first[LAW_STATES + 1];
    return law_move(p, signal, state->fixed, t, h, state->x, first);
}
";

pub(super) const PYTHON_PLAIN_STEP: &str = "    def begin_events(self, signal):
        pass

    def step(self, signal, t, h):
        self.x = self.move(signal, t, h, self.x)[0]
";

pub(super) const C_HISTORY_LENGTH: &str = "
/* Number of steps whose inputs are remembered for the delays; every file that includes this one needs the same. */
#ifndef LAW_HISTORY
#define LAW_HISTORY 1024
#endif
";

pub(super) const C_HISTORY_FIELDS: &str = "    /* Inputs of the past steps: a ring of cubics, each in powers of the time since its begin history_t. */
    int newest, remembered;
    double history_t[LAW_HISTORY], history[LAW_HISTORY][LAW_INPUTS + 1][4];
";

pub(super) const PYTHON_CROSSINGS: &str = "
#   crossings(inputs)               events, for the argument `events` of solve_ivp";
