//! Stacks runs that are side by side in one table: `Time Run #1, Angle Run #1, Time Run #2, Angle Run #2`.

use super::dialect::Sheet;
use super::heading::Heading;
use super::roles::is_time;
use crate::column::TRAJECTORY;

/// Words that stand before the number of a run in a column name.
const RUN_WORDS: [&str; 12] = [
    "run",
    "trial",
    "lauf",
    "versuch",
    "messung",
    "test",
    "take",
    "series",
    "serie",
    "essai",
    "experiment",
    "set",
];

/// Columns of one of several runs that are side by side, in the order of the common names.
struct Block {
    label: String,
    columns: Vec<usize>,
}

/// Stacks runs that are side by side in a table and adds a column `trajectory` with their labels.
///
/// The runs are recognised by names that differ only in the number of the run (`Run #1`, `Run 2: `), or by a
/// repeated time column (`t, x, t, x`). Other tables are unchanged.
pub(super) fn stacked(sheet: Sheet) -> Sheet {
    let Some(names) = sheet.names.clone() else { return sheet };
    let is_empty = |c: usize| names[c].is_empty() && (0..sheet.rows()).all(|r| sheet.row(r)[c].is_empty());
    let columns: Vec<usize> = (0..sheet.columns).filter(|&c| !is_empty(c)).collect();
    let blocks = repeated_times(&names, &sheet.units, &columns).or_else(|| numbered_runs(&names, &columns));
    match blocks {
        Some((bases, blocks)) => stack(sheet, bases, &blocks),
        None => sheet,
    }
}

/// Splits a column name into the name without the run number, and that number; `None` without a run number.
fn run_number(name: &str) -> Option<(String, String)> {
    let lower = name.to_lowercase();
    for word in RUN_WORDS {
        for (begin, _) in lower.match_indices(word) {
            let is_word = !lower[..begin].ends_with(|c: char| c.is_alphanumeric());
            let after = lower[begin + word.len()..].trim_start_matches([' ', '#', '_', '.']);
            let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
            if !is_word || digits.is_empty() || !name.is_char_boundary(begin) || lower.len() != name.len() {
                continue;
            }
            let end = lower.len() - after.len() + digits.len();
            let trim =
                |text: &str| text.trim_matches([' ', ':', ',', '-', '_', '(', ')', '[', ']', '.']).to_owned();
            // The brackets of a unit beside the number remain: `Time (s) Run #1`.
            let before = name[..begin].trim_end_matches([' ', ':', ',', '-', '_', '(', '[', '.']).trim();
            let base = if before.is_empty() {
                name[end..].trim_start_matches([' ', ':', ',', '-', '_', '.', ')', ']']).trim()
            } else {
                before
            };
            let rest = if before.is_empty() { String::new() } else { trim(&name[end..]) };
            let base = if rest.is_empty() { base.to_owned() } else { format!("{base} ({rest})") };
            return (!base.is_empty()).then_some((base, digits));
        }
    }
    None
}

/// Column name without its run number or the number at its end, as in `angle_2`, `angle.1` or `angle 2`.
fn without_number(name: &str) -> String {
    if let Some((base, _)) = run_number(name) {
        return base;
    }
    let base = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let base = base.trim_end_matches(['.', '_', ' ', '#', '-']);
    if base.is_empty() { name.to_owned() } else { base.to_owned() }
}

/// Finds runs that each begin with a time column of the same name, apart from a number.
///
/// Returns the common column names and the columns of each run; `None` for other tables.
fn repeated_times(
    names: &[String],
    units: &[String],
    columns: &[usize],
) -> Option<(Vec<String>, Vec<Block>)> {
    let unit = |c: usize| units.get(c).map_or("", String::as_str);
    let times: Vec<usize> = (0..columns.len())
        .filter(|&k| is_time(&Heading::read(&without_number(&names[columns[k]]), unit(columns[k]))))
        .collect();
    if times.len() < 2 || times[0] != 0 {
        return None;
    }
    let ends = times.iter().skip(1).copied().chain([columns.len()]);
    let ranges: Vec<&[usize]> = times.iter().zip(ends).map(|(&begin, end)| &columns[begin..end]).collect();
    let bases =
        |range: &[usize]| -> Vec<String> { range.iter().map(|&c| without_number(&names[c])).collect() };
    let first = bases(ranges[0]);
    // Logger Pro names the last run `Latest`, and a table may repeat whole names: only the bases count.
    if first.len() < 2 || ranges.iter().any(|range| bases(range) != first) {
        return None;
    }
    let block = |(k, range): (usize, &&[usize])| Block {
        label: run_number(&names[range[0]])
            .map_or_else(|| format!("run {}", k + 1), |(_, n)| format!("run {n}")),
        columns: range.to_vec(),
    };
    Some((first, ranges.iter().enumerate().map(block).collect()))
}

/// Finds runs whose column names hold the run number; columns without one belong to all runs.
///
/// Returns the common column names and the columns of each run; `None` for other tables.
fn numbered_runs(names: &[String], columns: &[usize]) -> Option<(Vec<String>, Vec<Block>)> {
    let mut shared: Vec<usize> = Vec::new();
    let mut runs: Vec<(String, Vec<(String, usize)>)> = Vec::new();
    for &c in columns {
        match run_number(&names[c]) {
            None => shared.push(c),
            Some((base, number)) => match runs.iter_mut().find(|(label, _)| *label == number) {
                Some((_, columns)) => columns.push((base, c)),
                None => runs.push((number, vec![(base, c)])),
            },
        }
    }
    let bases =
        |run: &[(String, usize)]| -> Vec<String> { run.iter().map(|(base, _)| base.clone()).collect() };
    let first = bases(&runs.first()?.1);
    if runs.len() < 2 || runs.iter().any(|(_, run)| bases(run) != first) {
        return None;
    }
    let header = shared.iter().map(|&c| names[c].clone()).chain(first).collect();
    let block = |(label, run): (String, Vec<(String, usize)>)| Block {
        label: format!("run {label}"),
        columns: shared.iter().copied().chain(run.into_iter().map(|(_, c)| c)).collect(),
    };
    Some((header, runs.into_iter().map(block).collect()))
}

/// Stacks the runs `blocks` of a table below each other; rows without values in a run are left out there.
fn stack(sheet: Sheet, bases: Vec<String>, blocks: &[Block]) -> Sheet {
    let first = &blocks[0].columns;
    let units = match sheet.units.is_empty() {
        true => Vec::new(),
        false => [String::new()].into_iter().chain(first.iter().map(|&c| sheet.units[c].clone())).collect(),
    };
    let names = [TRAJECTORY.to_owned()].into_iter().chain(bases).collect();
    let mut out = sheet.emptied(names, units);
    for block in blocks {
        for row in 0..sheet.rows() {
            let cells = sheet.row(row);
            let has_value = block.columns.iter().filter(|&&c| !cells[c].is_empty()).count() > 1;
            if has_value {
                let values = block.columns.iter().map(|&c| cells[c].clone());
                out.append(sheet.lines[row], [block.label.clone()].into_iter().chain(values));
            }
        }
    }
    out.comments.push(format!("{}{} runs are side by side", crate::foreign::NOTE_MARK, blocks.len()));
    out
}

#[cfg(test)]
mod tests {
    //! Contract: runs side by side are stacked, and tables of several sensors are unchanged.
    use super::*;
    use crate::sniff::dialect::read_table;
    use std::path::Path;

    fn read(text: &str) -> Sheet {
        stacked(read_table(Path::new("f"), text, None, None).unwrap_or_else(|e| panic!("{text}: {e}")))
    }

    #[test]
    fn runs_side_by_side_are_stacked() {
        for header in [
            "Time (s) Run #1,Angle (rad) Run #1,Time (s) Run #2,Angle (rad) Run #2",
            "Run 1: Time (s),Run 1: Angle (rad),Run 2: Time (s),Run 2: Angle (rad)",
            "Time (s),Angle (rad),Time (s),Angle (rad)",
            "Time (s),Angle (rad),Time (s).1,Angle (rad).1",
        ] {
            let sheet = read(&format!("{header}\n0,1,0,2\n0.1,3,0.1,4\n0.2,5,,\n"));
            assert_eq!(
                sheet.names.as_ref().expect("names").join("|"),
                "trajectory|Time (s)|Angle (rad)",
                "{header}"
            );
            let rows: Vec<String> = (0..sheet.rows()).map(|r| sheet.row(r).join("|")).collect();
            assert_eq!(
                rows,
                ["run 1|0|1", "run 1|0.1|3", "run 1|0.2|5", "run 2|0|2", "run 2|0.1|4"],
                "{header}"
            );
        }
        let shared = read("t_s,angle_rad run 1,angle_rad run 2\n0,1,2\n0.1,3,4\n");
        assert_eq!((shared.rows(), shared.row(3).join("|")), (4, "run 2|0.1|4".to_owned()));
    }

    #[test]
    fn several_sensors_are_not_runs() {
        for text in
            ["t_s,x1_m,x2_m\n0,1,2\n1,2,3\n", "t,run,x\n0,1,2\n1,1,3\n", "time,test_1_V,y\n0,1,2\n1,2,3\n"]
        {
            assert_eq!(read(text).columns, 3, "{text}");
        }
    }
}
