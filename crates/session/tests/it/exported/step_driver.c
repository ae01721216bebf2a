/* Replays a plan by the step function of an exported model: law.h and law.c.
 *
 * The plan has the number of samples, then for each sample its time and, for each input, the coefficients of its cubic. */
#include "law.h"
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv) {
    law_parameters p = law_default_parameters();
    law_state state;
    double x[LAW_STATES + 1] = {0.0}, u[LAW_INPUTS + 1] = {0.0}, du[LAW_INPUTS + 1] = {0.0}, y[LAW_OUTPUTS + 1] = {0.0};
    double t = 0.0, before = 0.0;
    int samples = 0, error = 0;
    FILE *plan = argc > 1 ? fopen(argv[1], "r") : NULL;
    if (!plan || fscanf(plan, "%d", &samples) != 1) return 1;
    for (int i = 0; i < LAW_STATES && 2 + i < argc; i++) x[i] = strtod(argv[2 + i], NULL);
    for (int k = 0; k < samples && !error; k++) {
        double last[LAW_INPUTS + 1] = {0.0}, slope[LAW_INPUTS + 1] = {0.0};
        for (int i = 0; i < LAW_INPUTS; i++) last[i] = u[i], slope[i] = du[i];
        if (fscanf(plan, "%lf", &t) != 1) return 1;
        for (int i = 0; i < LAW_INPUTS; i++) {
            double square, cube;
            if (fscanf(plan, "%lf %lf %lf %lf", &u[i], &du[i], &square, &cube) != 4 || square != 0.0 || cube != 0.0) return 1;
        }
        if (k == 0) law_init(&state, t, x, u, &p);
        else error = law_step(&state, last, slope, t - before, &p);
        before = t;
        law_outputs(&state, u, du, &p, y);
        for (int o = 0; o < LAW_OUTPUTS; o++) printf("%.17g\n", y[o]);
    }
    fclose(plan);
    if (error) fprintf(stderr, "%s\n", law_message(error));
    return error;
}
