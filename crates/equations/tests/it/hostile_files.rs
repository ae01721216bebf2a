//! Contract: no text makes the reader or the compiler panic, hang or print an unlimited message.
//!
//! The files are the examples with random changes of characters and insertions of words of the grammar, so
//! that most of them are parsed far. Their number is small by default; `AUGSIM_FUZZ_FILES=10000000 cargo test
//! --release -p augsim-equations --test it hostile_files` tests as many as asked.

use augsim_equations::{EXAMPLES, System, model};
use rand::{Rng, RngExt, SeedableRng};
use std::time::{Duration, Instant};

const WORDS: [&str; 48] = [
    "(",
    ")",
    "+",
    "-",
    "*",
    "/",
    "^",
    ",",
    "<",
    ">=",
    "if(",
    "sin(",
    "sqrt(",
    "table(",
    "slope(",
    "t",
    "pi",
    "0",
    "1e308",
    "1e-320",
    "99999",
    ".",
    "\"",
    "\"\"\"",
    "{",
    "}",
    "[",
    "]",
    "=",
    "\n",
    "#",
    "\u{1b}",
    "é",
    "[[events]]",
    "[tables.a]",
    "at = [0.0, 1.0]",
    "nan",
    "inf",
    "-1",
    "theta_rad",
    "x_m",
    "_m_s",
    "unit = \"V^0.5\"",
    "rest = {",
    "direction = \"both\"",
    "min = 0.0",
    "x_m^x_m^x_m",
    "clamp(",
];

fn mutated(random: &mut impl Rng, text: &str) -> String {
    let mut chars: Vec<char> = text.chars().collect();
    for _ in 0..random.random_range(1..6) {
        let at = random.random_range(0..=chars.len());
        match random.random_range(0..5) {
            0 => {
                let until = (at + random.random_range(0..20)).min(chars.len());
                chars.drain(at..until);
            }
            1 => {
                let from = random.random_range(0..=chars.len());
                let until = (from + random.random_range(0..60)).min(chars.len());
                let copy: Vec<char> = chars[from..until].to_vec();
                chars.splice(at..at, copy);
            }
            2 if at < chars.len() => chars[at] = char::from(random.random_range(0..128_u8)),
            _ => {
                let word = WORDS[random.random_range(0..WORDS.len())];
                let times = if random.random_range(0..20) == 0 { 300 } else { 1 };
                chars.splice(at..at, word.repeat(times).chars());
            }
        }
    }
    chars.into_iter().collect()
}

#[test]
fn no_file_makes_the_reader_panic_hang_or_print_without_limit() {
    let files: u64 = std::env::var("AUGSIM_FUZZ_FILES").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000);
    let (mut read, mut compiled) = (0, 0);
    for file in 0..files {
        let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(file);
        let (_, example) = EXAMPLES[file as usize % EXAMPLES.len()];
        let text = mutated(&mut random, example);
        let begin = Instant::now();
        match model::parse(&text, "fuzz.toml") {
            Ok(model) => {
                read += 1;
                let active: Vec<usize> = (0..model.parameters.len()).collect();
                compiled += u64::from(System::compile(&model, &active).is_ok());
            }
            Err(error) => {
                let message = error.to_string();
                assert!(message.starts_with("fuzz.toml:"), "seed {file}: {message}");
                assert!(message.len() < 4000, "seed {file}: {} bytes", message.len());
                assert!(!message.chars().any(|c| c.is_control() && c != '\n'), "seed {file}: {message:?}");
            }
        }
        assert!(begin.elapsed() < Duration::from_secs(5), "seed {file} took {:?}", begin.elapsed());
    }
    // If the changes broke every file, only the first lines of the reader would be tested.
    assert!(read > files / 50 && compiled > files / 100, "{read} read, {compiled} compiled of {files}");
}

#[test]
fn the_most_expensive_allowed_expressions_compile_quickly() {
    let rate = |text: &str, lets: &str| {
        format!(
            "scenario = \"system\"\n[states]\nx = {{}}\ny = {{}}\n[let]\n{lets}\n[rates]\nx = \"{text}\"\ny = \"x\"\n[outputs]\nz = {{ value = \"x\" }}\n"
        )
    };
    // Each value uses the one before it twice: 2^200 nodes as a tree, but 200 as a graph.
    let mut doubling = "a0 = \"x\"\n".to_owned();
    (1..200).for_each(|i| doubling.push_str(&format!("a{i} = \"a{} * a{} + y\"\n", i - 1, i - 1)));
    let many_switches: String = (0..150).map(|i| format!("+if(sin(x*{i})<y,x,y)")).collect();
    let deep = format!("{}x{}", "sin(".repeat(60), ")".repeat(60));
    for (text, lets) in [
        ("a199".to_owned(), doubling.as_str()),
        (format!("x{many_switches}"), ""),
        (deep, ""),
        ("x^64^1".to_owned(), ""),
        (format!("x{}", "+x*y".repeat(1000)), ""),
        (format!("x{}", "*1.0000001".repeat(400)), ""),
    ] {
        let begin = Instant::now();
        let model = model::parse(&rate(&text, lets), "worst.toml").unwrap_or_else(|e| panic!("{e}"));
        System::compile(&model, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert!(
            begin.elapsed() < Duration::from_secs(2),
            "{:?}: {}",
            begin.elapsed(),
            &text[..40.min(text.len())]
        );
    }
}
