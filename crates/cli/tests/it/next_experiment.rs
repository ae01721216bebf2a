//! Contract: a discovery that leaves two explanations leads to a plan whose runs decide between them; the recordings
//! may be judged together or one by one; requests that cannot be met are errors that name the remedy, and write nothing.

use crate::command::{augsim, fail, succeed, succeed_json};
use std::fmt::Write;
use std::path::Path;

const MODEL: &str = "scenario = \"system\"\nname = \"cart\"\n[inputs]\nforce_N = { hold = \"linear\" }\n[states]\n\
    x_m = { start = 0.0, sd = 0.001 }\nv_m_s = { start = 0.0, sd = 0.001 }\n[parameters]\nm_kg = { nominal = 1.0, frozen = true }\n\
    [rates]\nx_m = \"v_m_s\"\nv_m_s = \"force_N / m_kg\"\n[outputs]\npos_m = { value = \"x_m\", sd = \"estimate\" }\n";
const LIMITS: &str = "duration_s = 4.0\nsample_s = 0.05\n[inputs.force_N]\nrange = [-1.0, 1.0]\n[ranges]\npos_m = [-4.0, 4.0]\n\
    [starts]\nx_m = 0.0\nv_m_s = 0.0\n";

/// Position of a cart of 1 kg with viscous friction 0.7 N s/m at the sample times of `inputs` (time, force), with noise of 1 cm.
fn cart(name: &str, inputs: &[(f64, f64)], seed: u64) -> String {
    let (mut x, mut v, mut state, mut text) = (0.0, 0.0, seed.wrapping_mul(0x9e37_79b9) + 1, String::new());
    for (k, (t, force)) in inputs.iter().enumerate() {
        let noise: f64 = (0..12)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64
            })
            .sum::<f64>()
            - 6.0;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name},{t},{force},{:.6}", x + 0.01 * noise);
        let Some((next, force_then)) = inputs.get(k + 1) else { break };
        let step = (next - t) / 200.0;
        for i in 0..200 {
            let f = force + (force_then - force) * f64::from(i) / 200.0;
            v += step * (f - 0.7 * v);
            x += step * v;
        }
    }
    text
}

/// Runs a designed experiment: the inputs of a file of the plan.
fn run_of_plan(file: &Path, name: &str, seed: u64) -> String {
    let text = std::fs::read_to_string(file).expect("a planned run");
    let row = |line: &str| {
        let (t, force) = line.split_once(',').expect("two columns");
        (t.parse().expect("a time"), force.parse().expect("a force"))
    };
    cart(name, &text.lines().skip(1).map(row).collect::<Vec<_>>(), seed)
}

/// A folder with the model, recordings that leave two friction laws, the limits, and a discovery in `found`.
fn scene() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    let runs = (0..10_u32).map(|i| {
        let force = 0.5 + 0.02 * f64::from(i % 3);
        let inputs: Vec<(f64, f64)> = (0..61).map(|k| (0.02 * f64::from(k), force)).collect();
        cart(&format!("r{i}"), &inputs, u64::from(i) + 1)
    });
    let write = |name: &str, text: &str| std::fs::write(d.join(name), text).expect("written");
    write("first.csv", &("trajectory,t_s,force_N,pos_m\n".to_owned() + &runs.collect::<String>()));
    write("model.toml", MODEL);
    write("limits.toml", LIMITS);
    let discover = ["discover", "model.toml", "first.csv", "--only", "coulomb,linear-damping"];
    let found = succeed_json(&[&discover[..], &["--null-runs", "0", "--out", "found"]].concat(), d);
    assert_eq!(found["models"]["rivals"].as_array().map(Vec::len), Some(1), "{}", found["sentence"]);
    dir
}

#[test]
fn a_plan_decides_between_the_explanations_of_a_discovery() {
    let dir = scene();
    let d = dir.path();
    let plan = ["next", "found", "--limits", "limits.toml", "--sequences", "50", "--out", "plan"];
    let planned = succeed_json(&plan, d);
    let sentence = planned["sentence"].as_str().expect("a sentence");
    assert!(sentence.contains("1 run of 4 s tells linear-damping from coulomb"), "{sentence}");
    let page = std::fs::read_to_string(d.join("plan/report.html")).expect("a page");
    for text in
        ["force_N (N)", "predicted pos_m", "pos_m (m)", "duration, s", "nats", "50 simulated sequences"]
    {
        assert!(page.contains(text), "`{text}` is not on the page");
    }

    let head = "trajectory,t_s,force_N,pos_m\n";
    let runs = [1, 2].map(|k| run_of_plan(&d.join("plan/run-1.csv"), &format!("new{k}"), 40 + k));
    std::fs::write(d.join("both.csv"), head.to_owned() + &runs.concat()).expect("written");
    for (k, run) in runs.iter().enumerate() {
        std::fs::write(d.join(format!("new{k}.csv")), head.to_owned() + run).expect("written");
    }
    let heard = succeed_json(&["listen", "plan", "both.csv", "--out", "heard"], d);
    assert_eq!(heard["verdict"], "enough", "{heard}");
    let sentence = heard["sentence"].as_str().expect("a sentence");
    assert!(
        sentence.starts_with("Enough: linear-damping. 2 runs reject every other explanation"),
        "{sentence}"
    );
    assert!(sentence.contains("Promised for 1 run in nine of ten cases: odds of"), "{sentence}");
    let page = std::fs::read_to_string(d.join("heard/report.html")).expect("a page");
    assert!(page.contains("new2") && page.contains("rejected") && !page.contains("1 runs"));

    // One by one the recordings say the same.
    succeed(&["listen", "plan", "new0.csv", "--out", "heard-1"], d);
    let both = succeed_json(&["listen", "heard-1", "new1.csv", "--out", "heard-2"], d);
    for k in 0..2 {
        let e_value =
            |run: &serde_json::Value| run["explanations"][k]["log_e_value"].as_f64().expect("a number");
        assert!((e_value(&both) - e_value(&heard)).abs() < 1e-6, "{} {}", e_value(&both), e_value(&heard));
    }
    // One explanation is left, so a new plan narrows its parameters.
    let told = succeed(&["next", "heard", "--limits", "limits.toml", "--budget", "1", "--out", "plan-2"], d);
    assert!(told.contains("There is one explanation; 1 run of 4 s narrows its parameters by"), "{told}");
}

#[test]
fn a_plan_with_two_explanations_left_is_gone_on_with() {
    let dir = scene();
    let d = dir.path();
    let next = ["next", "--limits", "limits.toml", "--sequences", "50"];
    succeed(&[&next[..], &["found", "--out", "plan"]].concat(), d);
    // One more run as the first ones: it leaves both explanations.
    let head = "trajectory,t_s,force_N,pos_m\n";
    let weak = cart("weak", &(0..61).map(|k| (0.02 * f64::from(k), 0.52)).collect::<Vec<_>>(), 90);
    std::fs::write(d.join("weak.csv"), head.to_owned() + &weak).expect("written");
    let out = augsim(&["listen", "plan", "weak.csv", "--out", "heard", "--json"], d);
    assert_eq!(out.status.code(), Some(1), "{}", String::from_utf8_lossy(&out.stderr));
    let heard: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!(heard["verdict"], "more", "{heard}");

    // The new plan has the first recordings and the run that was heard, and promises further runs.
    let again = succeed_json(&[&next[..], &["heard", "--out", "plan-2"]].concat(), d);
    let sentence = again["sentence"].as_str().expect("a sentence");
    assert!(sentence.contains("1 run of 4 s tells linear-damping from coulomb"), "{sentence}");
    let length = |key: &str| again[key].as_array().map(Vec::len);
    assert_eq!((length("earlier"), length("heard"), length("explanations")), (Some(10), Some(1), Some(2)));
    assert_eq!((&again["promise"]["heard_before"], &again["verdict"]), (&1.into(), &"plan".into()));
    let strong = run_of_plan(&d.join("plan-2/run-1.csv"), "strong", 91);
    std::fs::write(d.join("strong.csv"), head.to_owned() + &strong).expect("written");
    let in_turn = succeed_json(&["listen", "plan-2", "strong.csv", "--out", "heard-2"], d);
    assert_eq!(in_turn["verdict"], "enough", "{in_turn}");
    let sentence = in_turn["sentence"].as_str().expect("a sentence");
    assert!(sentence.starts_with("Enough: linear-damping. 2 runs reject every other"), "{sentence}");
    assert!(sentence.contains("Promised for 1 run in nine of ten cases: odds of"), "{sentence}");

    // The evidence is that of both runs for the first plan.
    std::fs::write(d.join("both.csv"), head.to_owned() + &weak + &strong).expect("written");
    let at_once = succeed_json(&["listen", "plan", "both.csv", "--out", "heard-both"], d);
    for k in 0..2 {
        let e_value =
            |run: &serde_json::Value| run["explanations"][k]["log_e_value"].as_f64().expect("a number");
        let [one, other] = [&in_turn, &at_once].map(e_value);
        assert!((one - other).abs() < 1e-6, "{one} {other}");
    }
}

#[test]
fn requests_that_cannot_be_met_are_errors_and_write_nothing() {
    let dir = scene();
    let d = dir.path();
    let write = |name: &str, text: &str| std::fs::write(d.join(name), text).expect("written");
    write("far.toml", &LIMITS.replace("[-4.0, 4.0]", "[10.0, 11.0]"));
    write("typing.toml", &LIMITS.replace("force_N", "force"));
    write("ball.toml", "scenario = \"ball\"\n");
    let next = ["next", "found", "--out", "plan", "--limits"];
    fail(2, &[&next[..], &["far.toml"]].concat(), d, &["no input within the limits", "pos_m", "widen"]);
    fail(2, &[&next[..], &["typing.toml"]].concat(), d, &["typing.toml", "`force`", "force_N"]);
    fail(2, &["next", "ball.toml", "--out", "plan"], d, &["ball.toml", "models of equations"]);
    assert!(!d.join("plan/plan.json").exists() && !d.join("plan/run.toml").exists());

    succeed(&["next", "found", "--limits", "limits.toml", "--sequences", "20", "--out", "plan"], d);
    write("other.csv", "trajectory,t_s,force_N,height_m\na,0,1,0\na,0.1,1,0\n");
    fail(3, &["listen", "plan", "other.csv", "--out", "heard"], d, &["other.csv", "pos_m"]);
    fail(
        2,
        &["listen", "found", "first.csv", "--out", "heard"],
        d,
        &["found", "no plan.json", "augsim next"],
    );
    write("plan/plan.json", "{}");
    fail(2, &["listen", "plan", "first.csv", "--out", "heard"], d, &["plan.json", "augsim next"]);
    assert!(!d.join("heard/plan.json").exists() && !d.join("heard/run.toml").exists());
}

#[test]
fn a_plan_that_cannot_decide_says_so() {
    let dir = scene();
    let d = dir.path();
    std::fs::write(d.join("small.toml"), LIMITS.replace("[-1.0, 1.0]", "[0.0, 0.02]")).expect("written");
    let plan =
        ["next", "found", "--limits", "small.toml", "--sequences", "20", "--budget", "1", "--out", "plan"];
    let out = augsim(&plan, d);
    assert_eq!(out.status.code(), Some(1), "{}", String::from_utf8_lossy(&out.stderr));
    let told = String::from_utf8_lossy(&out.stdout).into_owned();
    for text in ["1 run of 4 s is not enough to tell linear-damping from coulomb", "Hardest is", "nats"] {
        assert!(told.contains(text), "`{text}` is not in {told}");
    }
}

#[test]
fn a_pool_of_recorded_runs_is_replayed() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    let mut pool = "trajectory,t_s,force_N,pos_m\n".to_owned();
    for i in 0..12_u32 {
        // Small constant forces say little; every fourth run has a sine.
        let force = |t: f64| if i % 4 == 3 { (1.5 * t).sin() } else { 0.1 + 0.01 * f64::from(i) };
        let inputs: Vec<(f64, f64)> = (0..41).map(|k| 0.05 * f64::from(k)).map(|t| (t, force(t))).collect();
        pool += &cart(&format!("p{i}"), &inputs, u64::from(i) + 70);
    }
    let write = |name: &str, text: &str| std::fs::write(d.join(name), text).expect("written");
    write("pool.csv", &pool);
    let model = |parameter: &str, friction: &str| {
        let parameters =
            format!("c = {{ nominal = 0.5, min = 0.05, max = 5.0, unit = \"{parameter}\" }}\n[rates]");
        MODEL
            .replace("[rates]", &parameters)
            .replace("\"force_N / m_kg\"", &format!("\"(force_N - {friction}) / m_kg\""))
    };
    write("viscous.toml", &model("N*s/m", "c * v_m_s"));
    let width = "w_m_s = { nominal = 0.02, frozen = true }\n[rates]";
    write("dry.toml", &model("N", "c * tanh(v_m_s / w_m_s)").replace("[rates]", width));
    let replay =
        ["reproduce", "next", "pool.csv", "--explanations", "viscous.toml", "dry.toml", "--orders", "4"];
    let result = succeed_json(&[&replay[..], &["--out", "a"]].concat(), d);
    let pool = &result["pools"][0];
    assert_eq!((pool["runs"].as_u64(), pool["verdict"].as_str()), (Some(12), Some("viscous")), "{pool}");
    let runs = |arm: &str| pool[arm].as_f64().expect("a number of runs");
    assert!(runs("designed") <= runs("random"), "{pool}");
    succeed(&[&replay[..], &["--out", "b"]].concat(), d);
    let read = |name: &str| std::fs::read_to_string(d.join(name).join("result.json")).expect("a result");
    assert_eq!(read("a"), read("b"));
    let page = std::fs::read_to_string(d.join("a/report.html")).expect("a page");
    assert!(
        page.contains("augsim reproduce next pool.csv --explanations viscous.toml dry.toml"),
        "the command"
    );

    fail(2, &["reproduce", "next", "pool.csv"], d, &["--explanations"]);
    fail(2, &["reproduce", "next"], d, &["reproduce next", "--data"]);
    fail(
        2,
        &["reproduce", "ball", "pool.csv", "--explanations", "dry.toml"],
        d,
        &["reproduce next", "--data"],
    );
}

#[test]
fn releases_from_rest_do_not_make_a_promise_that_cannot_be_kept() {
    // Rough initial speeds of a release are far off. Parameters that took up their errors once promised odds of a million to 1 for
    // two laws whose predictions are the same line.
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    let pendulum = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/systems/pendulum/");
    let [model, data] = ["model.toml", "swings.csv"].map(|name| format!("{pendulum}{name}"));
    let laws = ["--only", "coulomb,stribeck", "--null-runs", "0", "--out", "found"];
    let found = succeed_json(&[&["discover", &model, &data], &laws[..]].concat(), d);
    assert_eq!(found["models"]["rivals"].as_array().map(Vec::len), Some(1), "{}", found["sentence"]);
    std::fs::write(d.join("limits.toml"), "[starts]\ntheta_rad = [-1.5, 1.5]\n").expect("written");
    let plan = ["next", "found", "--limits", "limits.toml", "--budget", "1", "--sequences", "20", "--json"];
    let planned = augsim(&plan, d);
    assert_eq!(planned.status.code(), Some(1), "the run is not enough");
    let planned: serde_json::Value = serde_json::from_slice(&planned.stdout).expect("JSON");
    for draws in planned["promise"]["effective_draws"].as_array().expect("draws of each law") {
        assert!(draws.as_f64().is_some_and(|n| n > 50.0), "{draws}");
    }
    for odds in planned["plan"][0]["odds"].as_array().expect("odds of each pair") {
        assert!(odds["log_odds"].as_f64().is_some_and(|nats| (-1.0..3.0).contains(&nats)), "{odds}");
    }
}
