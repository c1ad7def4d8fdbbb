//! Figures: the tables that benchmarks print, as data files, and BENCHMARKS.md with these tables.
//!
//! A file of `xtask/bench/figures` has the tables of one command. A line `# …` says on which machine
//! it ran, and begins a new run. The lines of a table have cells between tabs; the first one has the
//! titles. An empty line ends a table.
//!
//! In BENCHMARKS.md, the lines between `<!-- figures: NAME NUMBER -->` and `<!-- end -->` are the
//! machine and the table of this number, from 1, of the file `NAME.tsv`.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

const BEGIN: &str = "<!-- figures: ";
const END: &str = "<!-- end -->";

/// A table, and the machine on which its command ran.
#[derive(Debug, PartialEq)]
struct Table {
    machine: String,
    /// The titles first.
    rows: Vec<Vec<String>>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn data_file(name: &str) -> PathBuf {
    root().join(format!("xtask/bench/figures/{name}.tsv"))
}

/// Writes BENCHMARKS.md with the tables of the data files.
pub(crate) fn render() -> Result<(), String> {
    let path = root().join("BENCHMARKS.md");
    let page = std::fs::read_to_string(&path).map_err(|e| format!("BENCHMARKS.md: {e}"))?;
    let page = rendered(&page)?;
    std::fs::write(&path, page).map_err(|e| format!("BENCHMARKS.md: {e}"))
}

/// The page with the tables of the data files.
fn rendered(page: &str) -> Result<String, String> {
    let mut out = String::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        out += line;
        out.push('\n');
        let Some(named) = line.strip_prefix(BEGIN) else {
            continue;
        };
        let named = named.strip_suffix(" -->").and_then(|n| n.split_once(' '));
        let wrong = || format!("BENCHMARKS.md: `{line}` is not `{BEGIN}NAME NUMBER -->`");
        let (name, number) = named.ok_or_else(wrong)?;
        let number: usize = number.parse().map_err(|_| wrong())?;
        let path = data_file(name);
        let text = std::fs::read_to_string(&path);
        let text = text.map_err(|e| format!("{}: {e}", path.display()))?;
        let tables = read(&text);
        let table = number.checked_sub(1).and_then(|at| tables.get(at));
        let table = table.ok_or_else(|| format!("{name}.tsv has no table {number}"))?;
        if !table.machine.is_empty() {
            writeln!(out, "{}\n", table.machine).map_err(|e| e.to_string())?;
        }
        out += &markdown(&table.rows);
        if !lines.any(|line| line == END) {
            return Err(format!("BENCHMARKS.md: no `{END}` follows `{line}`"));
        }
        out += END;
        out.push('\n');
    }
    Ok(out)
}

/// The tables of a data file.
fn read(text: &str) -> Vec<Table> {
    let (mut machine, mut tables) = ("", Vec::new());
    let mut rows: Vec<Vec<String>> = Vec::new();
    // The empty line at the end closes the last table.
    for line in text.lines().chain([""]) {
        if let Some(text) = line.strip_prefix("# ") {
            machine = text;
        } else if !line.is_empty() {
            rows.push(line.split('\t').map(str::to_owned).collect());
        } else if !rows.is_empty() {
            tables.push(Table {
                machine: machine.to_owned(),
                rows: std::mem::take(&mut rows),
            });
        }
    }
    tables
}

fn markdown(rows: &[Vec<String>]) -> String {
    let mut out = String::new();
    for (at, row) in rows.iter().enumerate() {
        for cell in row {
            out += "| ";
            out += cell;
            if !cell.is_empty() {
                out.push(' ');
            }
        }
        out += "|\n";
        if at == 0 {
            out += &"|---".repeat(row.len());
            out += "|\n";
        }
    }
    out
}

/// The name of the data file of a command: `bench record exact` has `record-exact`.
pub(crate) fn name(args: &[&str]) -> String {
    let words = match args {
        ["bench", rest @ ..] if !rest.is_empty() => rest,
        all => all,
    };
    // Durations, numbers and other options are not part of it.
    let is_named = |word: &&&str| {
        **word == "--repeat" || !(word.starts_with("--") || word.parse::<u64>().is_ok())
    };
    let words = words.iter().filter(is_named);
    let words = words.map(|word| word.trim_start_matches("--"));
    words.collect::<Vec<_>>().join("-")
}

/// Prints the output of a command, and returns its tables as a data file.
pub(crate) fn follow(output: impl Read, machine: &str) -> Result<String, String> {
    let mut data = format!("# {machine}\n");
    let mut inside = false;
    for line in BufReader::new(output).lines() {
        let line = line.map_err(|error| error.to_string())?;
        println!("{line}");
        let cells = line
            .strip_prefix('|')
            .and_then(|line| line.strip_suffix('|'));
        match cells {
            // Below the titles.
            Some(cells) if cells.chars().all(|c| matches!(c, '-' | ':' | '|')) => {}
            Some(cells) => {
                let cells: Vec<&str> = cells.split('|').map(str::trim).collect();
                data += &cells.join("\t");
                data.push('\n');
            }
            None if inside => data.push('\n'),
            None => {}
        }
        inside = cells.is_some();
    }
    Ok(data)
}

/// Writes the data file of a command.
pub(crate) fn save(args: &[&str], data: &str) -> Result<(), String> {
    if read(data).is_empty() {
        return Err(format!("`{}` has printed no table", args.join(" ")));
    }
    let path = data_file(&name(args));
    std::fs::write(&path, data).map_err(|e| format!("{}: {e}", path.display()))?;
    println!("saved: {}", path.display());
    Ok(())
}

/// This machine, and its load before the command.
pub(crate) fn machine() -> String {
    let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let cpus = read("/proc/cpuinfo");
    let model = cpus.lines().find(|line| line.starts_with("model name"));
    let model = model.and_then(|line| line.split_once(": "));
    let model = model.map_or("an unknown processor", |(_, name)| name.trim());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let release = read("/proc/sys/kernel/osrelease");
    let kernel: Vec<&str> = release.trim().split('.').take(2).collect();
    let load = read("/proc/loadavg");
    let load = load.split(' ').next().unwrap_or("?").to_owned();
    let kernel = kernel.join(".");
    format!("{model}, {cores} cores, Linux {kernel}, load {load} before the start:")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The longest that the page may be without its tables.
    const PROSE: usize = 150;

    fn page() -> String {
        std::fs::read_to_string(root().join("BENCHMARKS.md")).expect("BENCHMARKS.md")
    }

    #[test]
    fn the_page_has_the_tables_of_the_data_files() {
        let page = page();
        let fresh = rendered(&page).expect("a page");
        assert!(page == fresh, "run `cargo xtask figures`");
        // A table without data is not in the page.
        let (mut inside, mut stray) = (false, Vec::new());
        for line in page.lines() {
            inside = (inside || line.starts_with(BEGIN)) && line != END;
            if line.starts_with('|') && !inside {
                stray.push(line);
            }
        }
        assert!(stray.is_empty(), "{stray:?}");
    }

    #[test]
    fn each_data_file_is_in_the_page() {
        let page = page();
        let files = std::fs::read_dir(root().join("xtask/bench/figures")).expect("the files");
        let files: Vec<_> = files.flatten().map(|file| file.path()).collect();
        assert!(files.len() > 10, "{files:?}");
        for path in files {
            let name = path.file_stem().expect("a name").to_string_lossy();
            let text = std::fs::read_to_string(&path).expect("a file");
            for number in 1..=read(&text).len() {
                let marker = format!("{BEGIN}{name} {number} -->");
                assert!(page.contains(&marker), "no `{marker}`");
            }
        }
    }

    #[test]
    fn the_prose_is_short() {
        let page = page();
        let (mut inside, mut count) = (false, 0);
        for line in page.lines() {
            inside = (inside || line.starts_with(BEGIN)) && line != END;
            count += usize::from(!inside && !line.is_empty() && line != END);
        }
        assert!(count <= PROSE, "{count} lines of prose, at most {PROSE}");
    }

    #[test]
    fn the_tables_of_a_command_are_saved_and_rendered() {
        let output = "warming up\n| µs | p50 | |\n|---|---:|---|\n| query | 7 | met |\n\nand\n| a |\n|---|\n| |\n";
        let data = follow(output.as_bytes(), "a machine:").expect("data");
        assert_eq!(data, "# a machine:\nµs\tp50\t\nquery\t7\tmet\n\na\n\n");
        let tables = read(&data);
        assert_eq!(tables.len(), 2);
        assert_eq!(tables[0].machine, "a machine:");
        assert_eq!(
            markdown(&tables[0].rows),
            "| µs | p50 | |\n|---|---|---|\n| query | 7 | met |\n"
        );
    }

    #[test]
    fn a_data_file_has_the_name_of_its_command() {
        assert_eq!(name(&["bench"]), "bench");
        assert_eq!(name(&["bench", "record", "exact"]), "record-exact");
        assert_eq!(name(&["soak", "dds", "600"]), "soak-dds");
        assert_eq!(name(&["chaos", "--minutes", "20"]), "chaos");
        assert_eq!(name(&["bench", "--repeat", "5", "--every", "12"]), "repeat");
    }
}
