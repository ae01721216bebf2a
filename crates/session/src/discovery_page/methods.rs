//! Remarks at the end of the report, and the methods used with their references.

use augsim_discovery::Discovery;
use augsim_report::page::{Method, estimate_text, significant};

/// Remarks: windows left out, autocorrelated residuals, further measured quantities, prediction horizons.
pub(super) fn notes(d: &Discovery) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(windows) = &d.windows {
        let ([train, test], [a, b]) = (windows.fitted, windows.excluded);
        notes.push(format!(
            "{train} windows were fitted and {test} predicted; {a} and {b} of them were excluded: {}.",
            windows.rule
        ));
    }
    notes.extend(d.independent.map(|share| {
        format!(
            "Residuals of the chosen model are autocorrelated; the effective sample size is {:.0} % of the samples, and gains are scaled by it.",
            100.0 * share
        )
    }));
    notes.extend(d.horizons.iter().flat_map(|h| {
        h.errors.iter().map(|(measure, e)| {
            let (value, interval) = estimate_text(e.reduction.rmse, e.reduction.ci95);
            format!(
                "Error {} s after a measured state ({} predictions), {measure}, {}: declared {}, calibrated {}, augmented {}; gain over calibration {value} [{interval}].",
                h.horizon_s,
                h.forecasts,
                e.unit,
                significant(e.declared.rmse, 3),
                significant(e.calibrated.rmse, 3),
                significant(e.augmented.rmse, 3)
            )
        })
    }));
    notes
}

/// Methods that this discovery used, with references.
pub(super) fn methods(d: &Discovery) -> Vec<Method> {
    let method = |name: &str, purpose: &str, reference: &str| Method {
        name: name.to_owned(),
        purpose: purpose.to_owned(),
        reference: reference.to_owned(),
    };
    let mut methods = vec![
        method(
            "Variable projection",
            "eliminates the initial states from every fit",
            "Golub, Pereyra: The Differentiation of Pseudo-Inverses and Nonlinear Least Squares, 1973",
        ),
        method(
            "Levenberg-Marquardt with exact sensitivities",
            "fits through events and contact, by dual numbers with the derivative of the event time",
            "Marquardt: An Algorithm for Least-Squares Estimation of Nonlinear Parameters, 1963",
        ),
        method(
            "Block cross-validation in one Gauss-Newton step",
            "how well a set of effects predicts data that it was not fitted to",
            "Beirami, Razaviyayn, Shahrampour, Tarokh: On Optimal Generalizability in Parametric Learning, 2017",
        ),
        method(
            "Block jackknife",
            "tests whether an effect differs from zero, valid for correlated residuals",
            "Kuensch: The Jackknife and the Bootstrap for General Stationary Observations, 1989",
        ),
        method(
            "Effective sample size",
            "autocorrelated residuals count less in a gain",
            "Bartlett: On the Theoretical Specification and Sampling Properties of Autocorrelated Time-Series, 1946",
        ),
        method(
            "Bayesian bootstrap over blocks",
            "share of the resampled data sets in which a finding is found again",
            "Rubin: The Bayesian Bootstrap, 1981",
        ),
        method(
            "q-values under dependence",
            "expected share of false findings among all that are at least as significant",
            "Benjamini, Yekutieli: The Control of the False Discovery Rate in Multiple Testing under Dependency, 2001",
        ),
    ];
    if d.tests.periodicity.is_some() {
        methods.push(method(
            "Laplace approximation, evidence fixed point",
            "random effects: a parameter that differs from event to event",
            "MacKay: Bayesian Interpolation, Neural Computation 1992",
        ));
    }
    if d.null_records.is_some() {
        methods.push(method(
            "Wild cluster bootstrap",
            "false-alarm rate: how often an effect is found in data like these when none is missing",
            "Cameron, Gelbach, Miller: Bootstrap-Based Improvements for Inference with Clustered Errors, 2008",
        ));
    }
    if d.error.folds.is_some() {
        methods.push(method(
            "Nested cross-validation",
            "errors on data used neither for fitting nor for choosing the model",
            "Varma, Simon: Bias in Error Estimation When Using Cross-Validation for Model Selection, 2006",
        ));
    }
    methods.extend([
        method(
            "Sandwich covariance",
            "intervals of the parameters",
            "White: Maximum Likelihood Estimation of Misspecified Models, 1982",
        ),
        method(
            "Bootstrap over records",
            "intervals of the errors on held-out data",
            "Efron, Tibshirani: An Introduction to the Bootstrap, 1993",
        ),
    ]);
    methods
}
