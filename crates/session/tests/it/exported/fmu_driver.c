/* Simulates a plan with a Functional Mock-up Unit, by the functions of FMI 2.0 alone.
 *
 * Arguments: library, GUID, "cs" or "me", plan, numbers of states, inputs, outputs and indicators, steps in each interval,
 * initial states. Variables are numbered as states, rates, inputs, outputs. */
#include "fmi2.h"
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX = 64 };
static void *library;
static fmi2Component unit;
static int states, inputs, outputs, indicators, steps;
static double cubic[MAX][4], begin; /* of each input, in powers of the time since `begin` */
static double next_jump;

#define CALL(result, name, types, args) \
    do { \
        fmi2Status (*function) types; \
        *(void **)&function = dlsym(library, #name); \
        if (!function) exit(3); \
        if (function args > fmi2Warning) { fprintf(stderr, "%s fails\n", #name); exit(result); } \
    } while (0)

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...) {
    va_list list;
    (void)environment; (void)status;
    va_start(list, text);
    fprintf(stderr, "%s %s: ", name, category);
    vfprintf(stderr, text, list);
    fprintf(stderr, "\n");
    va_end(list);
}

static void set_inputs(double t) {
    for (int i = 0; i < inputs; i++) {
        double s = t - begin, *c = cubic[i], u = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
        fmi2ValueReference vr = (fmi2ValueReference)(2 * states + i);
        CALL(4, fmi2SetReal, (fmi2Component, const fmi2ValueReference *, size_t, const fmi2Real *), (unit, &vr, 1, &u));
    }
}

static void print_outputs(void) {
    for (int o = 0; o < outputs; o++) {
        fmi2ValueReference vr = (fmi2ValueReference)(2 * states + inputs + o);
        double y;
        CALL(5, fmi2GetReal, (fmi2Component, const fmi2ValueReference *, size_t, fmi2Real *), (unit, &vr, 1, &y));
        printf("%.17g\n", y);
    }
}

static void co_simulate(double t, double dt) {
    for (int i = 0; i < inputs; i++) {
        fmi2ValueReference vr[3];
        fmi2Integer order[3] = {1, 2, 3};
        fmi2Real value[3] = {cubic[i][1], 2.0 * cubic[i][2], 6.0 * cubic[i][3]};
        vr[0] = vr[1] = vr[2] = (fmi2ValueReference)(2 * states + i);
        CALL(6, fmi2SetRealInputDerivatives, (fmi2Component, const fmi2ValueReference *, size_t, const fmi2Integer *, const fmi2Real *),
             (unit, vr, 3, order, value));
    }
    print_outputs();
    if (dt <= 0.0) return;
    /* Half of the step is undone, so that saved states are tried as well. */
    fmi2FMUstate saved = NULL;
    CALL(7, fmi2GetFMUstate, (fmi2Component, fmi2FMUstate *), (unit, &saved));
    CALL(7, fmi2DoStep, (fmi2Component, fmi2Real, fmi2Real, fmi2Boolean), (unit, t, 0.5 * dt, fmi2True));
    CALL(7, fmi2SetFMUstate, (fmi2Component, fmi2FMUstate), (unit, saved));
    CALL(7, fmi2FreeFMUstate, (fmi2Component, fmi2FMUstate *), (unit, &saved));
    CALL(7, fmi2DoStep, (fmi2Component, fmi2Real, fmi2Real, fmi2Boolean), (unit, t, dt, fmi2True));
}

static void handle_event(double t) {
    fmi2EventInfo info = {fmi2True, 0, 0, 0, 0, 0.0};
    CALL(8, fmi2EnterEventMode, (fmi2Component), (unit));
    set_inputs(t);
    for (int round = 0; info.newDiscreteStatesNeeded && round < 100; round++)
        CALL(8, fmi2NewDiscreteStates, (fmi2Component, fmi2EventInfo *), (unit, &info));
    next_jump = info.nextEventTimeDefined ? info.nextEventTime : INFINITY;
    CALL(8, fmi2EnterContinuousTimeMode, (fmi2Component), (unit));
}

static void rates(double t, const double *x, double *rate) {
    CALL(9, fmi2SetTime, (fmi2Component, fmi2Real), (unit, t));
    set_inputs(t);
    CALL(9, fmi2SetContinuousStates, (fmi2Component, const fmi2Real *, size_t), (unit, x, (size_t)states));
    CALL(9, fmi2GetDerivatives, (fmi2Component, fmi2Real *, size_t), (unit, rate, (size_t)states));
}

/* A step of the classical Runge-Kutta method; the unit is then at its end. */
static void step(double t, double h, const double *x, double *end) {
    double a[MAX], b[MAX], c[MAX], d[MAX], stage[MAX];
    rates(t, x, a);
    for (int i = 0; i < states; i++) stage[i] = x[i] + 0.5 * h * a[i];
    rates(t + 0.5 * h, stage, b);
    for (int i = 0; i < states; i++) stage[i] = x[i] + 0.5 * h * b[i];
    rates(t + 0.5 * h, stage, c);
    for (int i = 0; i < states; i++) stage[i] = x[i] + h * c[i];
    rates(t + h, stage, d);
    for (int i = 0; i < states; i++) end[i] = x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
    CALL(9, fmi2SetContinuousStates, (fmi2Component, const fmi2Real *, size_t), (unit, end, (size_t)states));
}

/* Whether an indicator has another sign than in `z`. */
static int crosses(const double *z) {
    double now[MAX];
    CALL(10, fmi2GetEventIndicators, (fmi2Component, fmi2Real *, size_t), (unit, now, (size_t)indicators));
    for (int i = 0; i < indicators; i++)
        if ((now[i] > 0.0) != (z[i] > 0.0)) return 1;
    return 0;
}

/* Advances to t + h in steps that end at the events of the states. */
static void advance(double t, double h) {
    double end = t + h;
    for (int round = 0; round < 1000 && t < end; round++) {
        double x[MAX], next[MAX], z[MAX], low = 0.0, high = end - t;
        fmi2Boolean event = fmi2False, stop = fmi2False;
        CALL(11, fmi2GetContinuousStates, (fmi2Component, fmi2Real *, size_t), (unit, x, (size_t)states));
        CALL(11, fmi2GetEventIndicators, (fmi2Component, fmi2Real *, size_t), (unit, z, (size_t)indicators));
        step(t, high, x, next);
        int has_event = crosses(z);
        while (has_event && high - low > 1e-15 + 1e-15 * t) {
            double middle = 0.5 * (low + high);
            if (middle <= low || middle >= high) break;
            step(t, middle, x, next);
            if (crosses(z)) high = middle;
            else low = middle;
        }
        if (has_event) step(t, high, x, next);
        t = has_event ? t + high : end;
        CALL(11, fmi2CompletedIntegratorStep, (fmi2Component, fmi2Boolean, fmi2Boolean *, fmi2Boolean *), (unit, fmi2True, &event, &stop));
        if (has_event) handle_event(t);
    }
}

static void exchange(double t, double dt) {
    handle_event(t);
    print_outputs();
    if (dt <= 0.0) return;
    double end = t + dt;
    while (t < end) {
        double to = next_jump > t && next_jump < end ? next_jump : end;
        int parts = (int)fmax(1.0, ceil((to - t) / dt * steps - 1e-9));
        double from = t, h = (to - from) / parts;
        for (int k = 0; k < parts; k++) advance(from + k * h, k + 1 == parts ? to - (from + k * h) : h);
        t = to;
        if (to == next_jump) handle_event(t);
    }
}

int main(int argc, char **argv) {
    if (argc < 10) return 2;
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        return 2;
    }
    int is_me = strcmp(argv[3], "me") == 0, samples;
    states = atoi(argv[5]), inputs = atoi(argv[6]), outputs = atoi(argv[7]), indicators = atoi(argv[8]), steps = atoi(argv[9]);
    FILE *plan = fopen(argv[4], "r");
    if (!plan || fscanf(plan, "%d", &samples) != 1 || states > MAX || inputs > MAX || indicators > MAX) return 2;
    fmi2Component (*instantiate)(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *, fmi2Boolean, fmi2Boolean);
    *(void **)&instantiate = dlsym(library, "fmi2Instantiate");
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    if (!instantiate || instantiate("wrong", fmi2CoSimulation, "{another}", "", &callbacks, 0, 0)) return 2;
    unit = instantiate("unit", is_me ? fmi2ModelExchange : fmi2CoSimulation, argv[2], "", &callbacks, 0, 0);
    if (!unit) return 2;
    double *t = calloc((size_t)samples + 1, sizeof *t), (*c)[4] = calloc((size_t)(samples * inputs) + 1, sizeof *c);
    for (int k = 0; k < samples; k++) {
        if (fscanf(plan, "%lf", &t[k]) != 1) return 2;
        for (int i = 0; i < inputs; i++) {
            double *q = c[k * inputs + i];
            if (fscanf(plan, "%lf %lf %lf %lf", &q[0], &q[1], &q[2], &q[3]) != 4) return 2;
        }
    }
    for (int i = 0; i < states && 10 + i < argc; i++) {
        fmi2ValueReference vr = (fmi2ValueReference)i;
        double x = strtod(argv[10 + i], NULL);
        CALL(4, fmi2SetReal, (fmi2Component, const fmi2ValueReference *, size_t, const fmi2Real *), (unit, &vr, 1, &x));
    }
    CALL(12, fmi2SetupExperiment, (fmi2Component, fmi2Boolean, fmi2Real, fmi2Real, fmi2Boolean, fmi2Real), (unit, 0, 0.0, t[0], 0, 0.0));
    CALL(12, fmi2EnterInitializationMode, (fmi2Component), (unit));
    memcpy(cubic, c, sizeof *c * (size_t)inputs);
    begin = t[0];
    set_inputs(t[0]);
    CALL(12, fmi2ExitInitializationMode, (fmi2Component), (unit));
    for (int k = 0; k < samples; k++) {
        double dt = k + 1 < samples ? t[k + 1] - t[k] : 0.0;
        memcpy(cubic, c + k * inputs, sizeof *c * (size_t)inputs);
        begin = t[k];
        if (is_me) exchange(t[k], dt);
        else {
            set_inputs(t[k]);
            co_simulate(t[k], dt);
        }
    }
    CALL(13, fmi2Terminate, (fmi2Component), (unit));
    return 0;
}
