//! Judges the answers of `augsim discover` to trap sets (see [`super`]).

use super::kinds::{Class, Kind};
use serde_json::Value;

/// Exit code with which `augsim` rejects bad data.
const BAD_DATA: i32 = 3;

/// Answer of `augsim discover` to one data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The program wrote a result.
    Found {
        /// Verdict of the result.
        verdict: String,
        /// Kinds of the effects that the result claims.
        effects: Vec<String>,
    },
    /// The program rejected the data; holds the first line of its message.
    Refused(String),
    /// The program failed in another way; holds the first line of the message.
    Failed(String),
}

impl Answer {
    /// Makes an answer from the exit code and the output of the program.
    pub fn read(code: Option<i32>, stdout: &[u8], stderr: &[u8]) -> Self {
        let Ok(found) = serde_json::from_slice::<Value>(stdout) else {
            let text = String::from_utf8_lossy(stderr);
            let is_error = |line: &&str| line.contains("error") || line.contains("panicked");
            let line = text.lines().find(is_error).unwrap_or_default().chars().take(160).collect();
            return if code == Some(BAD_DATA) { Self::Refused(line) } else { Self::Failed(line) };
        };
        let effects = found["effects"].as_array().into_iter().flatten();
        Self::Found {
            verdict: found["verdict"].as_str().unwrap_or_default().to_owned(),
            effects: effects.filter_map(|e| e["kind"].as_str()).map(str::to_owned).collect(),
        }
    }
}

/// Whether one answer of the discovery is right, and whether it names an absent effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// Whether the discovery's answer is right.
    pub is_right: bool,
    /// Whether the answer claims an effect that is neither true nor equivalent to the logging fault.
    pub names_absent_effect: bool,
}

/// Decides whether an answer to a data set with the peculiarity `kind` is right.
pub fn judge(kind: &Kind, answer: &Answer) -> Judgement {
    let (verdict, effects) = match answer {
        Answer::Found { verdict, effects } => (verdict.as_str(), effects.as_slice()),
        Answer::Refused(_) => {
            return Judgement { is_right: kind.class() == Class::Logging, names_absent_effect: false };
        }
        Answer::Failed(_) => return Judgement { is_right: false, names_absent_effect: false },
    };
    let is_allowed =
        |name: &String| kind.allowed.iter().any(|allowed| name.split(" on ").next() == Some(*allowed));
    let names_absent_effect = !effects.iter().all(is_allowed);
    let is_right = match kind.class() {
        Class::Noise | Class::Declared => verdict == "nothing-to-add",
        Class::Logging => true,
        Class::Defect => ["unknown", "partly-explained", "not-this-system"].contains(&verdict),
    };
    Judgement { is_right: is_right && !names_absent_effect, names_absent_effect }
}

#[cfg(test)]
mod tests {
    //! Contract: each class has its own right answers; an allowed effect counts with or without its place;
    //! rejection of the data is right only for logging faults, and a crash never.
    use super::super::kinds::KINDS;
    use super::*;

    fn named(name: &str) -> &'static Kind {
        KINDS.iter().find(|kind| kind.name == name).expect("a kind")
    }

    fn found(verdict: &str, effects: &[&str]) -> Answer {
        Answer::Found {
            verdict: verdict.to_owned(),
            effects: effects.iter().map(|e| (*e).to_owned()).collect(),
        }
    }

    fn is_right(kind: &str, answer: &Answer) -> bool {
        judge(named(kind), answer).is_right
    }

    #[test]
    fn each_class_has_its_right_verdicts() {
        for kind in ["white noise", "saturated input declared"] {
            assert!(is_right(kind, &found("nothing-to-add", &[])));
            assert!(!is_right(kind, &found("unknown", &[])));
        }
        for verdict in ["nothing-to-add", "unknown", "not-this-system"] {
            assert!(is_right("columns swapped", &found(verdict, &[])), "{verdict}");
            assert_eq!(is_right("bumped once", &found(verdict, &[])), verdict != "nothing-to-add");
        }
        assert!(!is_right("bumped once", &found("partly-explained", &["coulomb on v_m_s"])));
    }

    #[test]
    fn an_effect_equivalent_to_the_fault_may_be_named() {
        let delay = found("explained", &["input-delay on force_N"]);
        assert!(is_right("input early by 4 samples", &delay));
        let both = found("explained", &["input-delay", "coulomb on v_m_s"]);
        let judged = judge(named("input early by 4 samples"), &both);
        assert!(!judged.is_right && judged.names_absent_effect);
        assert!(judge(named("columns swapped"), &delay).names_absent_effect);
    }

    #[test]
    fn rejections_and_crashes_are_distinguished() {
        let refused = Answer::read(Some(3), b"", b"noise\naugsim: error: mixed units\n");
        assert_eq!(refused, Answer::Refused("augsim: error: mixed units".to_owned()));
        assert!(is_right("one recording in milliseconds", &refused) && !is_right("white noise", &refused));
        let crashed = Answer::read(Some(101), b"", b"thread 'main' panicked at x.rs:1:1\n");
        assert!(!is_right("one recording in milliseconds", &crashed));
    }

    #[test]
    fn leads_are_not_findings() {
        let text = br#"{"verdict": "unknown", "effects": [{"kind": "leak"}], "leads": [{"kind": "floor"}]}"#;
        assert_eq!(Answer::read(Some(0), text, b""), found("unknown", &["leak"]));
    }
}
