//! Contract (issue 19): a sweep is planned completely or not at all, with the error messages of the
//! command; tasks give the same bytes on any machine and in any order; completed tasks are not repeated;
//! changes and failures are reported. The tests use trainings of a few iterations on ten drops, and a
//! script in place of `sbatch` (benches/sweeps/slurm.sh uses real Slurm).

use crate::command::{augsim, fail, run, succeed};
use std::path::Path;
use std::process::Command;

const TRAININGS: &str = r#"
command = "train"

[options]
pybullet_ball = true
data = "drops.csv"
iterations = 12

[cross]
recipe = ["neural", "hybrid-plus"]
seed = { from = 1, to = 3 }

[scores]
loss_nats = "$.loss"
"#;

/// Makes a folder with ten ball drops and a sweep file of six trainings.
fn workplace() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    succeed(&["simulate", "--trajectories", "10", "--samples", "20", "--out", "drops.csv"], dir.path());
    std::fs::write(dir.path().join("sweep.toml"), TRAININGS).expect("a file");
    dir
}

/// Collects the results of a sweep plan and returns the name and text of each file.
fn collected(plan: &str, dir: &Path) -> Vec<(String, String)> {
    succeed(&["sweep", "collect", plan], dir);
    ["result.json", "table.csv", "report.html"]
        .map(|name| {
            let text =
                std::fs::read_to_string(dir.join(plan).join("collected").join(name)).expect("a result");
            (name.to_owned(), text)
        })
        .into()
}

fn plan(name: &str, dir: &Path) {
    succeed(&["sweep", "plan", "sweep.toml", "--out", name], dir);
}

#[test]
fn tasks_give_the_same_bytes_in_any_order() {
    let dir = workplace();
    let d = dir.path();
    plan("at-once", d);
    plan("one-by-one", d);
    succeed(&["sweep", "run", "at-once", "--all", "--threads", "3"], d);
    for index in [5, 0, 3] {
        succeed(&["sweep", "run", "one-by-one", "--index", &index.to_string(), "--threads", "2"], d);
    }
    // Empty folders stay, because another process may be about to write there.
    assert!(d.join("one-by-one/failed").is_dir(), "an empty folder that processes share is kept");
    for (variable, index) in [("SLURM_ARRAY_TASK_ID", "4"), ("JOB_COMPLETION_INDEX", "1")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_augsim"));
        let out = run(command.args(["sweep", "run", "one-by-one"]).env(variable, index).current_dir(d));
        assert!(out.status.success(), "{variable}: {}", String::from_utf8_lossy(&out.stderr));
    }
    succeed(&["sweep", "run", "one-by-one", "--index", "1", "--count", "2"], d);
    let [one, other] = ["at-once", "one-by-one"].map(|plan| collected(plan, d));
    assert!(one == other, "order or threads change what is collected");
    let table = &one[1].1;
    assert!(
        table.starts_with("task,id,state,data,iterations,pybullet-ball,recipe,seed,loss_nats\n"),
        "{table}"
    );
    assert_eq!(table.lines().filter(|line| line.contains(",done,drops.csv,12,true,")).count(), 6, "{table}");
    let page = &one[2].1;
    assert!(page.contains("Over recipe") && page.contains("loss_nats") && !page.contains("<script"));
    let result: serde_json::Value = serde_json::from_str(&one[0].1).expect("JSON");
    let over_recipe = result["curves"].as_array().expect("curves").iter().find(|c| c["over"] == "recipe");
    let point = &over_recipe.expect("a curve")["series"][0]["points"][0];
    assert!(
        point["tasks"] == 3 && point["ci95"].is_array(),
        "three seeds make a mean and its interval: {point}"
    );
}

#[test]
fn rejects_a_bad_sweep_before_any_output() {
    let dir = workplace();
    let d = dir.path();
    for (text, says) in [
        ("command = \"simulate\"", "cannot be swept; use one of train, discover, evaluate, reproduce"),
        (
            "command = \"train\"\n[options]\nrecipy = 1",
            "[options] recipy: `augsim train` has no option `recipy`",
        ),
        ("command = \"train\"\n[options]\nrecipe = \"hybrd\"", "invalid value 'hybrd' for '--recipe"),
        ("command = \"train\"\n[options]\niterations = -3", "invalid value '-3' for '--iterations"),
        ("command = \"train\"\n[options]\nout = \"x\"", "`out` cannot be set in a sweep"),
        ("command = \"train\"\n[cross]\nseed = []", "[cross] seed: the list is empty"),
        ("command = \"train\"\n[cross]\nseed = [1, 2, 1]", "[cross] seed: has 1 twice"),
        ("command = \"train\"\n[cross]\nseed = 3", "[cross] seed: give a list"),
        ("command = \"train\"\n[cross]\nseed = { from = 3, to = 1 }", "{ from = 1, to = 5 }"),
        ("command = \"train\"\n[cross]\ndata = [\"nope.csv\"]", "nope.csv: the input does not exist"),
        ("command = \"train\"\n[cross]\ndata = [\"*.npz\"]", "*.npz: no file matches"),
        ("command = \"train\"\n[cross]\ndata = [\"-\"]", "standard input"),
        ("command = \"train\"\n[options]\nresidual_of = \".\"", "--data"),
        ("command = \"train\"\n[scores]\nloss = \"loss\"", "[scores] loss = \"loss\": not a valid JSONPath"),
        (
            "command = \"train\"\n[scores]\nseed = \"$.loss\"\n[cross]\nseed = [1]",
            "`seed` is the name of an option",
        ),
        // The parser accepts this, but the command rejects it.
        ("command = \"train\"\n[options]\ndata = \"drops.csv\"", "no physics model is given"),
        ("command = \"evaluate\"\n[options]\ndata = \"drops.csv\"", "<MODEL|RUN>"),
        // Each value is valid, but one combination of flags is not.
        (
            "command = \"reproduce push\"\n[options]\niterations = 5\n[cross]\nquick = [false, true]\nseed = [1, 2]",
            "--quick",
        ),
        ("command = \"reproduce pull\"", "invalid value 'pull'"),
        ("command = \"train\"\nseeds = [1]", "line 2: unknown field `seeds`"),
    ] {
        std::fs::write(d.join("bad.toml"), text).expect("a file");
        let error = fail(2, &["sweep", "plan", "bad.toml", "--out", "plan"], d, &[]);
        assert!(error.contains("bad.toml: ") && error.contains(says), "{text}\n{error}");
        assert!(error.trim_end().lines().count() == 1 && !d.join("plan").exists(), "{text}\n{error}");
    }
    let error = fail(2, &["sweep", "run", "nowhere", "--all"], d, &[]);
    assert!(error.contains("give the folder of `sweep plan`"), "{error}");
    plan("plan", d);
    let error = fail(2, &["sweep", "run", "plan", "--index", "6"], d, &[]);
    assert!(error.contains("has no task 6; its 6 tasks are 0 to 5"), "{error}");
    assert!(fail(2, &["sweep", "run", "plan"], d, &[]).contains("no task is given; use --index N"));
}

#[test]
fn task_ids_depend_on_content_and_survive_a_move() {
    let dir = workplace();
    let d = dir.path();
    plan("plan", d);
    succeed(&["sweep", "run", "plan", "--index", "0"], d);
    let tasks = std::fs::read_to_string(d.join("plan/tasks.jsonl")).expect("tasks");
    std::fs::create_dir(d.join("moved")).expect("a folder");
    for name in ["sweep.toml", "drops.csv"] {
        std::fs::rename(d.join(name), d.join("moved").join(name)).expect("it can be moved");
    }
    succeed(&["sweep", "plan", "moved/sweep.toml", "--out", "plan"], d);
    assert_eq!(std::fs::read_to_string(d.join("plan/tasks.jsonl")).expect("tasks"), tasks);
    // More seeds make another plan, which needs --force and keeps the results of common tasks.
    std::fs::write(d.join("moved/sweep.toml"), TRAININGS.replace("to = 3", "to = 4")).expect("a file");
    let error = fail(2, &["sweep", "plan", "moved/sweep.toml", "--out", "plan"], d, &[]);
    assert!(error.contains("contains another run") && error.contains("--force"), "{error}");
    succeed(&["sweep", "plan", "moved/sweep.toml", "--out", "plan", "--force"], d);
    let said = succeed(&["sweep", "run", "plan", "--all"], d);
    assert!(said.contains("8 of 8 tasks are done (1 of them before)"), "{said}");
}

#[test]
fn keeps_results_and_repeats_damaged_ones() {
    let dir = workplace();
    let d = dir.path();
    plan("plan", d);
    succeed(&["sweep", "run", "plan", "--all"], d);
    let results: Vec<_> = std::fs::read_dir(d.join("plan/results")).expect("results").flatten().collect();
    let modified = |k: usize| results[k].metadata().expect("a file").modified().expect("its time");
    let (first, text) = (modified(0), std::fs::read_to_string(results[0].path()).expect("a result"));
    let said = succeed(&["sweep", "run", "plan", "--all"], d);
    assert!(said.contains("6 of 6 tasks are done (6 of them before)"), "{said}");
    assert_eq!(modified(0), first, "a kept result is not written again");
    let damaged = text.replacen("\"loss\":", "\"loss\":1", 1);
    for bad in [&damaged, &text[..text.len() / 2], ""] {
        std::fs::write(results[0].path(), bad).expect("it can be written");
        let said = succeed(&["sweep", "run", "plan", "--all"], d);
        assert!(said.contains("(5 of them before)"), "{said}");
        assert_eq!(std::fs::read_to_string(results[0].path()).expect("a result"), text);
    }
}

#[test]
fn rejects_a_changed_input() {
    let dir = workplace();
    let d = dir.path();
    plan("plan", d);
    let drops = std::fs::read_to_string(d.join("drops.csv")).expect("drops");
    std::fs::write(d.join("drops.csv"), drops.replacen(",4", ",5", 1)).expect("it can be written");
    let error = fail(3, &["sweep", "run", "plan", "--index", "2"], d, &[]);
    assert!(
        error.contains("drops.csv: the input data has changed since")
            && error.contains("plan the sweep again")
    );
    std::fs::write(d.join("drops.csv"), drops).expect("it can be written");
    succeed(&["sweep", "run", "plan", "--index", "2"], d);
}

#[test]
fn reports_failed_tasks_and_collects_the_others_on_request() {
    let dir = workplace();
    let d = dir.path();
    std::fs::write(d.join("rubbish.csv"), "trajectory,t_s,height_m\na,0,high\n").expect("a file");
    let text =
        TRAININGS.replace("data = \"drops.csv\"\n", "").replace("[cross]", "[cross]\ndata = [\"*s*.csv\"]");
    std::fs::write(d.join("sweep.toml"), text.replace("to = 3", "to = 1")).expect("a file");
    std::fs::remove_file(d.join("drops.truth.csv")).expect("the truth of the drops");
    plan("plan", d);
    let error = fail(3, &["sweep", "run", "plan", "--all"], d, &[]);
    assert!(
        error.contains("2 tasks failed, the first of them task 2: ") && error.contains("rubbish.csv"),
        "{error}"
    );
    let said = succeed(&["sweep", "status", "plan"], d);
    assert!(said.contains("2 of 4 tasks are done; 0 running, 2 failed, 0 stopped, 0 waiting"), "{said}");
    assert!(said.contains("task 2 failed (code 3): ") && said.contains("rubbish.csv"), "{said}");
    let error = fail(1, &["sweep", "collect", "plan"], d, &[]);
    assert!(error.contains("2 of 4 tasks have no result") && error.contains("--partial"), "{error}");
    assert!(!d.join("plan/collected").exists());
    succeed(&["sweep", "collect", "plan", "--partial", "--out", "rest"], d);
    let table = std::fs::read_to_string(d.join("rest/table.csv")).expect("a table");
    assert_eq!(table.lines().filter(|line| line.contains(",failed,rubbish.csv,")).count(), 2, "{table}");
    assert_eq!(table.lines().filter(|line| line.contains(",done,drops.csv,")).count(), 2, "{table}");
    let page = std::fs::read_to_string(d.join("rest/report.html")).expect("a page");
    assert!(page.contains("Without a result") && page.contains("partial"));
}

#[test]
fn every_sweep_command_has_scores() {
    let dir = workplace();
    let d = dir.path();
    let sealed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/sealed");
    for name in ["model.toml", "bounces.csv"] {
        std::fs::copy(sealed.join(name), d.join(name)).expect("it can be copied");
    }
    plan("nets", d);
    succeed(&["sweep", "run", "nets", "--all"], d);
    for (name, text, column) in [
        ("discover", "[options]\nmodel = \"model.toml\"\ndata = \"bounces.csv\"", "error.augmented.rmse"),
        (
            "evaluate",
            "[options]\ndata = \"drops.csv\"\nrequire_pos_m = 1e-9\n[cross]\nrun = [\"nets/work/*/out\"]",
            "crps",
        ),
    ] {
        std::fs::write(d.join("sweep.toml"), format!("command = \"{name}\"\n{text}\n")).expect("a file");
        plan(name, d);
        let out = augsim(&["sweep", "run", name, "--all"], d);
        // A network after twelve iterations cannot predict to 1 nm, which is an outcome and not a
        // failure.
        let code = if name == "evaluate" { 1 } else { 0 };
        assert_eq!(out.status.code(), Some(code), "{}", String::from_utf8_lossy(&out.stderr));
        let table = collected(name, d)[1].1.clone();
        assert!(table.lines().next().is_some_and(|head| head.contains(column)), "{name}: {table}");
        assert_eq!(table.contains(",criterion-not-met,"), name == "evaluate", "{table}");
    }
}

#[cfg(unix)]
#[test]
fn submits_remaining_tasks_and_a_collecting_job() {
    use std::os::unix::fs::PermissionsExt;

    let dir = workplace();
    let d = dir.path();
    plan("plan", d);
    succeed(&["sweep", "run", "plan", "--index", "1"], d);
    let dry =
        succeed(&["sweep", "submit", "plan", "--dry-run", "--max-parallel", "4", "--partition", "long"], d);
    for line in [
        "#SBATCH --array=0,2-5%4\n",
        "#SBATCH --requeue\n",
        "#SBATCH --partition=long\n",
        "--dependency=afterany:",
    ] {
        assert!(dry.contains(line), "`{line}` is not in\n{dry}");
    }
    assert!(fail(2, &["sweep", "submit", "plan", "--time", "1; rm"], d, &[]).contains("--time 1; rm"));

    // Replacement of sbatch: stores its input, and runs it as the first array index.
    std::fs::create_dir(d.join("bin")).expect("a folder");
    let sbatch = "#!/bin/sh\n[ \"$1\" = --version ] && exit 0\necho \"$@\" >>\"$LOG\"\ncat >script\n\
                  SLURM_ARRAY_TASK_ID=0 SLURM_CPUS_PER_TASK=1 sh script >&2 || exit 1\necho \"7$(wc -l <\"$LOG\");cluster\"\n";
    let path = d.join("bin/sbatch");
    std::fs::write(&path, sbatch).expect("a file");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("it may be run");
    let search = format!("{}:{}", d.join("bin").display(), std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new(env!("CARGO_BIN_EXE_augsim"));
    let log = d.join("log");
    command.args(["--json", "sweep", "submit", "plan"]).env("PATH", search).env("LOG", &log).current_dir(d);
    let out = run(&mut command);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let told: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert!(told["array_job"] == "71" && told["collecting_job"] == "72", "{told}");
    let asked = std::fs::read_to_string(log).expect("what sbatch was asked");
    assert_eq!(asked, "--parsable\n--parsable --dependency=afterany:71\n");
    let table = std::fs::read_to_string(d.join("plan/collected/table.csv")).expect("the second job collects");
    assert_eq!(table.matches(",done,").count(), 2, "{table}");
    assert_eq!(table.matches(",missing,").count(), 4, "{table}");
}

/// Returns every TOML block of the documentation page on sweeps.
fn examples() -> Vec<String> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/sweeps.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let blocks = page.split("```toml\n").skip(1);
    blocks.map(|rest| rest.split("```").next().expect("a block that ends").to_owned()).collect()
}

#[test]
fn plans_the_sweeps_of_the_reference_page_and_the_benches() {
    let dir = workplace();
    let d = dir.path();
    for folder in ["runs", "PLAN/work/1/out"] {
        std::fs::create_dir_all(d.join(folder)).expect("a folder");
        std::fs::copy(d.join("drops.csv"), d.join(folder).join("a.csv")).expect("it can be copied");
    }
    let benches = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../benches/sweeps");
    let own = std::fs::read_dir(benches).expect("the benches").flatten().map(|entry| entry.path());
    let own = own.filter(|path| path.extension().is_some_and(|e| e == "toml"));
    let mut all: Vec<String> = own.map(|path| std::fs::read_to_string(path).expect("a sweep")).collect();
    all.extend(examples());
    assert_eq!(all.len(), 5, "two sweeps of the benches and three of the page");
    for (k, text) in all.iter().enumerate() {
        std::fs::write(d.join("sweep.toml"), text).expect("a file");
        plan(&format!("plan-{k}"), d);
    }
}
