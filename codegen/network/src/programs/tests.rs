//! Programs of copied components.

use crate::load::{Overrides, load};
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};

/// The output of `check` about the programs of a network with these components, a line each.
fn found(components: &[&str]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    };
    write("Cargo.toml", "[workspace]\nmembers = [\"*\"]\n");
    for place in ["clock", "copy"] {
        let cdsl = "Component clock { Communications {}; language rust; };\n";
        write(&format!("{place}/clock.cdsl"), cdsl);
        let manifest = "[package]\nname = \"clock\"\nversion = \"0.1.0\"\n";
        write(&format!("{place}/Cargo.toml"), manifest);
    }
    let instances: String = components
        .iter()
        .enumerate()
        .map(|(at, path)| format!("    Component c{at} {{ cdsl \"{path}\"; }};\n"))
        .collect();
    write("n.ddsl", &format!("Deployment n\n{{\n{instances}}};\n"));
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let path = folder.path().join("n.ddsl");
    let (network, more) =
        load(&path, &Overrides::default(), &mut sources, &loader).expect("a file");
    let network = network.expect("a network");
    assert!(
        !more.has_errors(),
        "{}",
        render(&sources, &more, Format::Short)
    );
    let mut found = Diagnostics::new();
    network.programs.check_generated(&mut found);
    render(&sources, &found, Format::Short)
}

#[test]
fn a_copy_of_a_component_has_no_program_of_its_own() {
    let copied = found(&["clock/clock.cdsl", "copy/clock.cdsl"]);
    let lines: Vec<&str> = copied
        .lines()
        .filter(|line| line.contains("copied-component"))
        .collect();
    let [line] = lines[..] else {
        panic!("{copied}")
    };
    assert!(
        line.contains("n.ddsl:4:25: error[copied-component]"),
        "{line}"
    );
    assert!(line.contains("first named here at"), "{line}");
    // Two instances of one component have one program.
    let twice = found(&["clock/clock.cdsl", "clock/../clock/clock.cdsl"]);
    let lines: Vec<&str> = twice
        .lines()
        .filter(|line| line.contains("copied-component"))
        .collect();
    // The copy that the network does not use has it, too.
    let [line] = lines[..] else { panic!("{twice}") };
    assert!(line.contains("n.ddsl:3:25: "), "{line}");
    assert!(line.contains("also in `copy`"), "{line}");
}
