//! Contract (issue 16): two commands turn a raw recording into a result; assumptions are printed in at
//! most ten lines; data that are not of a ball end with exit code 1 and no effect; the library,
//! templates, completions and manual pages come from the registry and the command definitions.

use crate::command::{augsim, succeed, succeed_json};
use std::path::Path;

/// Runs a command, which must exit with `code`, and returns its standard output.
fn printed(args: &[&str], code: i32, dir: &Path) -> String {
    let out = augsim(args, dir);
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(code), "{args:?}: {error}");
    String::from_utf8(out.stdout).expect("text")
}

/// Text of the demonstration data set as a tracker and a spreadsheet would write it.
///
/// It has centimetres, heights counted downwards from the image edge, decimal commas, and a note in each row.
fn recording() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/sealed/bounces.csv");
    let text = std::fs::read_to_string(path).expect("a fixture");
    let mut out = String::from("Tracker 6.0\n# exported\nWurf;Zeit (ms);x (cm);y (cm);Notiz\n");
    for line in text.lines().skip(1) {
        let c: Vec<&str> = line.split(',').collect();
        let number = |i: usize| c[i].parse::<f64>().expect("a number");
        let row = format!(
            "{};{:.6};{:.5};{:.5};gut",
            c[0],
            1e3 * number(1),
            1e2 * number(2),
            1e2 * (2.0 - number(3))
        );
        out += &(row.replace('.', ",") + "\n");
    }
    out
}

#[test]
fn two_commands_turn_a_recording_into_a_result() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    std::fs::write(d.join("wurf.csv"), recording()).expect("written");
    let text = printed(&["start", "wurf.csv", "--out", "begun"], 0, d);
    assert!(text.lines().count() <= 10, "{text}");
    for part in [
        "separated by `;`, decimals use commas",
        "Zeit (ms) is the time",
        "y (cm) grows downwards",
        "columns not used: Notiz",
        "throws in a plane",
        "floor at -2.0",
        "next: augsim discover begun/model.toml begun/data.csv",
    ] {
        assert!(text.contains(part), "`{part}` is not in:\n{text}");
    }
    let text = printed(&["discover", "begun/model.toml", "begun/data.csv", "--out", "found"], 0, d);
    // The true value of the fixture is 0.031 1/m.
    assert!(text.contains("The model lacks quadratic-drag (k_per_m = 0.031"), "{text}");
    assert!(text.contains("floor_height_m = -2.0"), "{text}");
    // Other commands read the same files and print the same notes; the height is then upwards with the
    // origin of the file.
    let out = augsim(&["data", "inspect", "wurf.csv"], d);
    assert!(String::from_utf8_lossy(&out.stderr).contains("read as a recording"), "{out:?}");
    assert!(String::from_utf8_lossy(&out.stdout).contains("z_m"), "{out:?}");
}

#[test]
fn what_is_no_ball_ends_with_code_1_and_a_remedy() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    let sealed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/sealed");
    let model =
        std::fs::read_to_string(sealed.join("model.toml")).expect("a fixture").replace(", frozen = true", "");
    std::fs::write(d.join("model.toml"), model).expect("written");
    let text = std::fs::read_to_string(sealed.join("bounces.csv")).expect("a fixture");
    let mut lines = text.lines();
    let mut doubled = format!("{}\n", lines.next().expect("a header"));
    for line in lines {
        let c: Vec<&str> = line.split(',').collect();
        let twice = |i: usize| 3.281 * c[i].parse::<f64>().expect("a number");
        doubled += &format!("{},{},{},{},{},{}\n", c[0], c[1], twice(2), twice(3), c[4], c[5]);
    }
    std::fs::write(d.join("feet.csv"), doubled).expect("written");
    let text = printed(&["discover", "model.toml", "feet.csv", "--out", "found"], 1, d);
    assert!(text.contains("Not this system: gravity fits 3") && text.contains("are these feet?"), "{text}");
    assert!(!text.contains("augmented"), "nothing was added: {text}");
    let result = std::fs::read_to_string(d.join("found/result.json")).expect("written");
    let result: serde_json::Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result["verdict"], "not-this-system");
    assert_eq!(result["effects"].as_array().map(Vec::len), Some(0));
    let page = std::fs::read_to_string(d.join("found/report.html")).expect("written");
    assert!(page.contains("not this system") && !page.contains("error with the effects added"));
}

#[test]
fn suggests_equations_for_other_recordings() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    let rows: String = (0..200)
        .map(|k| {
            let t = f64::from(k) / 100.0;
            format!("{t};{};{}\n", 0.4 * (3.0 * t).cos(), -1.2 * (3.0 * t).sin())
        })
        .collect();
    std::fs::write(d.join("swing.csv"), format!("time;angle (rad);rate_rad_s\n{rows}")).expect("written");
    let text = printed(&["start", "swing.csv", "--out", "begun"], 0, d);
    assert!(text.contains("augsim fit begun/model.toml begun/data.csv"), "{text}");
    assert!(text.lines().count() <= 10, "{text}");
    // The draft runs as it is, and recovers a linear system: the swing has the frequency 3 rad/s.
    let fitted = succeed_json(&["fit", "begun/model.toml", "begun/data.csv"], d);
    let stiffness = fitted["parameters"].as_array().expect("parameters").iter();
    let mut stiffness = stiffness.filter(|p| p["name"] == "stiffness_angle_rad_per_s2");
    let value = stiffness.next().and_then(|p| p["value"].as_f64()).expect("a stiffness");
    assert!((value - 9.0).abs() < 0.1, "{value}");
}

#[test]
fn keeps_every_column_and_drafts_inputs_and_outputs() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    for (header, inputs, outputs) in [
        ("run,time (s),voltage (V),encoder (rad)", &["voltage_V"][..], &["encoder_rad"][..]),
        ("experiment,time_s,heater_cmd_W,plate", &["heater_cmd_W"], &["plate"]),
        ("clip,time,angle (rad),speed (m/s)", &[], &["angle_rad", "speed_m_s"]),
        ("run,t_s,tau1_Nm,q1_furlong", &["tau1_N_m"], &["q1_furlong"]),
        ("lauf;zeit (s);Zufluss (m³/s);Füllhöhe (Skt)", &[], &["Zufluss_m3_per_s", "Fuellhoehe_Skt"]),
    ] {
        let separator = if header.contains(';') { ';' } else { ',' };
        let rows: String = (0..2)
            .flat_map(|run| (0..40).map(move |k| (run, f64::from(k) * 0.1)))
            .map(|(run, t)| format!("{run},{t},{},{}\n", (1.7 * t).sin(), (2.0 * t).cos() * 0.5))
            .collect();
        let rows = rows.replace(',', &separator.to_string());
        std::fs::write(d.join("log.csv"), format!("{header}\n{rows}")).expect("written");
        let started = succeed_json(&["start", "log.csv", "--out", "begun", "--force"], d);
        assert_eq!(started["inputs"], serde_json::json!(inputs), "{header}");
        assert_eq!(started["outputs"], serde_json::json!(outputs), "{header}");
        let shown = succeed(&["data", "inspect", "begun/data.csv"], d);
        for column in inputs.iter().chain(outputs) {
            assert!(shown.contains(column), "{column}: {shown}");
        }
        succeed(&["fit", "begun/model.toml", "begun/data.csv", "--force"], d);
        // The recording itself is read with the same names.
        succeed(&["fit", "begun/model.toml", "log.csv", "--force"], d);
    }
}

#[test]
fn effects_lists_the_library_with_data_requirements() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    let ball = printed(&["effects", "ball"], 0, d);
    for part in [
        "quadratic-drag",
        "a = -k |v - w| (v - w)",
        "k_per_m about 2.000e-2 1/m",
        "Nagurka",
        "needs: a recorded spin",
    ] {
        assert!(ball.contains(part), "`{part}` is not in:\n{ball}");
    }
    let push = printed(&["effects", "push"], 0, d);
    assert!(push.contains("table-anisotropy") && !push.contains("quadratic-drag"));
    let both = printed(&["effects"], 0, d);
    assert!(both.contains("table-anisotropy") && both.contains("quadratic-drag"));
    assert_eq!(printed(&["effects", "magnus"], 0, d).lines().filter(|l| !l.starts_with(' ')).count(), 2);
    let out = augsim(&["effects", "drag"], d);
    assert_eq!(out.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&out.stderr).contains("did you mean quadratic-drag or linear-drag"),
        "{out:?}"
    );
}

#[test]
fn writes_templates_and_suggests_full_effect_names() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    for name in ["ball", "push"] {
        assert!(printed(&["model", "new", name], 0, d).contains("next: augsim discover"));
        printed(&["effects", "--for", &format!("{name}.toml")], 0, d);
    }
    let text = std::fs::read_to_string(d.join("ball.toml")).expect("written");
    std::fs::write(d.join("drag.toml"), text + "[[effect]]\nkind = \"drag\"\n").expect("written");
    let out = augsim(&["effects", "--for", "drag.toml"], d);
    assert_eq!(out.status.code(), Some(3));
    let error = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(error.contains("did you mean `quadratic-drag` or `linear-drag`?"), "{error}");
}

#[test]
fn completions_manual_pages_and_examples_cover_every_command() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    for shell in ["bash", "zsh", "fish"] {
        let script = printed(&["completions", shell], 0, d);
        assert!(script.contains("discover") && script.contains("residual-of"), "{shell}");
    }
    printed(&["man", "--out", "man"], 0, d);
    let help = printed(&["--help"], 0, d);
    let commands = help.lines().skip_while(|l| *l != "Commands:").skip(1).take_while(|l| !l.is_empty());
    let names: Vec<&str> =
        commands.filter_map(|l| l.split_whitespace().next()).filter(|n| *n != "help").collect();
    assert!(names.contains(&"start") && names.contains(&"discover"), "{names:?}");
    for name in names {
        let page = std::fs::read_to_string(d.join(format!("man/augsim-{name}.1"))).expect("a page");
        assert!(page.contains("augsim"), "{name}");
        let help = printed(&[name, "--help"], 0, d);
        assert!(help.contains("Examples:\n  augsim "), "{name}:\n{help}");
    }
}
