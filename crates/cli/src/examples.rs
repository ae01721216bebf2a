//! Examples at the end of each `--help` text, one constant per command.

macro_rules! examples {
    ($($name:ident: $($line:literal),+;)+) => {
        $(pub const $name: &str = concat!("Examples:", $("\n  augsim ", $line),+);)+
    };
}

examples! {
    START: "start throws.csv", "start drops/ --out out/drops", "start video.txt --up -y --rate-hz 120",
        "start log.csv --time frame:frames --rate-hz 60 --columns 'px=x_m:0.0021,py=z_m:0.0021'";
    DEMO: "demo", "demo --out out/demo --seed 2";
    MODEL: "model new ball", "model new pendulum --out my.toml";
    FROM_ROBOT: "model from-robot arm.urdf log.csv --out out/arm",
        "model from-robot arm.urdf log.csv --torque 'joint_1=12.5 * current1_A' --free inertias,viscous",
        "model from-robot servo.xml steps/ --formulation forward";
    SIMULATE: "simulate --trajectories 200 --out out/drops.csv", "simulate my.toml --duration-s 5 --out out/swings.csv";
    FIT: "fit my.toml swings.csv --out out/fit";
    EFFECTS: "effects", "effects ball", "effects quadratic-drag", "effects --for my.toml",
        "effects coulomb --for my.toml --data swings.csv";
    DISCOVER: "discover out/start/model.toml out/start/data.csv", "discover model.toml throws.csv --group golf --out out/golf",
        "discover motor.toml runs/ --exclude ripple,stribeck";
    NEXT: "next out/discover --budget 3 --out plan", "next dry.toml viscous.toml --limits limits.toml --out plan";
    LISTEN: "listen plan new.csv --out heard", "listen heard another.csv --out heard-2";
    TRAIN: "train --data drops.csv --pybullet-ball --out out/run",
        "train --data throws.csv --residual-of out/discover --out out/run",
        "train --out out/run --resume";
    PREDICT: "predict out/run --data new.csv --out out/forecast.csv", "predict out/discover --data new.csv",
        "predict out/run --data new.csv --seen 1.1s --seen-columns height_m --sensor-sd 0.002";
    REPORT: "report out/discover", "report out/discover --figure worst --out worst.svg";
    EXPORT: "export out/discover --as python --out law.py", "export model.toml --as c --out law.c",
        "export model.toml --as fmu --out law.fmu", "export model.toml --as latex";
    EVALUATE: "evaluate out/run --data new.csv", "evaluate out/discover --data recordings.csv",
        "evaluate out/first out/second --data a.csv b.csv",
        "evaluate out/run --data new.csv --require-pos-m 0.1",
        "evaluate out/discover --data recordings.csv --protocol filtered --seen 0.1s,0.2s";
    REPRODUCE: "reproduce ball --quick", "reproduce league --scenario push --quick", "reproduce loop --data ../shared/data";
    SWEEP: "sweep plan sweep.toml --out out/sweep", "sweep run out/sweep", "sweep collect out/sweep";
    DATA: "data inspect drops.csv", "data inspect drops.csv --model model.toml",
        "data convert mit-push pushes/ out/pushes.csv --rate-hz 100";
    COMPLETIONS: "completions bash > ~/.local/share/bash-completion/completions/augsim",
        "completions zsh > ~/.zfunc/_augsim", "completions fish > ~/.config/fish/completions/augsim.fish";
    MAN: "man --out ~/.local/share/man/man1";
}
