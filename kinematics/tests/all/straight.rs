//! What compilers make of printed solvers: no branch, no loop, no call but of sine and cosine.

use crate::{ARM, load_beside};
use rc_formula::Operation;
use std::collections::BTreeMap;
use std::process::Command;

const TEXT: &str = "import \"arm.urdf\";
Kinematics cell
{
    solver fk { pose wrist in base; jacobian wrist in base; velocity wrist in base; acceleration wrist in base; };
    solver hold { efforts; mass_matrix; };
    solver drive { accelerations; payload part at wrist; };
};";

#[test]
fn solvers_have_no_branch() {
    let (cell, found) = load_beside(TEXT, &[("arm.urdf", ARM)]);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("cell.h"), rc_kinematics::c(&cell)).expect("a file");
    let text = "#include \"cell.h\"
void fk(const double *q, const double *v, const double *a, cell_fk_result *r) { cell_fk(q, v, a, r); }
void hold(const double *q, const double *v, const double *a, cell_hold_result *r) { cell_hold(q, v, a, r); }
void drive(const double *q, const double *v, const double *t, const double *p, cell_drive_result *r) { cell_drive(q, v, t, p, r); }
";
    std::fs::write(at("cell.c"), text).expect("a file");
    // Vectors of numbers would hide how many sums there are.
    let options = [
        "-std=c99",
        "-O2",
        "-fno-tree-vectorize",
        "-ffp-contract=off",
        "-c",
    ];
    let object = at("cell.o");
    let built = Command::new("cc")
        .args(options)
        .arg(at("cell.c"))
        .arg("-o")
        .arg(&object)
        .status();
    assert!(built.expect("a compiler").success());
    let shown = Command::new("objdump")
        .args(["-dr", "--no-show-raw-insn"])
        .arg(&object)
        .output();
    let Ok(shown) = shown else {
        let reason = "there is no objdump";
        rc_test_support::python::skipped("solvers_have_no_branch", reason);
        return;
    };
    let text = String::from_utf8(shown.stdout).expect("a text");
    if !text.contains("x86-64") {
        rc_test_support::python::skipped(
            "solvers_have_no_branch",
            "it knows the code of x86-64 only",
        );
        return;
    }
    // Counts of instructions by function; calls are by the names in relocations.
    let mut counts: BTreeMap<&str, BTreeMap<&str, usize>> = BTreeMap::new();
    let mut function = "";
    for line in text.lines() {
        if let Some((_, name)) = line
            .strip_suffix(">:")
            .and_then(|line| line.split_once('<'))
        {
            function = name;
            continue;
        }
        let Some((place, instruction)) = line.split_once('\t') else {
            continue;
        };
        let word = match place.trim().strip_suffix(':') {
            // An address, then the instruction.
            Some(_) => instruction.split_whitespace().next().unwrap_or_default(),
            None => continue,
        };
        *counts.entry(function).or_default().entry(word).or_default() += 1;
    }
    for line in text.lines().filter(|line| line.contains("R_X86_64_P")) {
        let name = line.rsplit('\t').next().unwrap_or_default();
        let known = ["sin", "cos", "sincos", ".rodata", ".LC"];
        assert!(known.iter().any(|known| name.starts_with(known)), "{line}");
    }
    for solver in &cell.solvers {
        let own = &counts[solver.name.as_str()];
        let jumps = own.iter().filter(|(word, _)| word.starts_with('j'));
        assert_eq!(jumps.count(), 0, "{}: {own:?}", solver.name);
        let of = |words: &[&str]| -> usize { words.iter().filter_map(|word| own.get(word)).sum() };
        let work = solver.work();
        // A compiler may have a difference for the opposite of a number.
        let nodes = solver.program.nodes().iter();
        let opposites = nodes
            .filter(|node| node.operation == Operation::Negate)
            .count();
        let (sums, products) = (of(&["addsd", "subsd"]), of(&["mulsd", "divsd"]));
        assert!(
            sums > 0 && sums <= work.sums + opposites,
            "{}: {sums} {work:?}",
            solver.name
        );
        assert!(
            products > 0 && products <= work.products,
            "{}: {products} {work:?}",
            solver.name
        );
        // The compiler has a call for sine and cosine of one angle.
        let calls = of(&["call"]);
        assert!(
            calls > 0 && calls <= work.functions,
            "{}: {calls} {work:?}",
            solver.name
        );
    }
}
