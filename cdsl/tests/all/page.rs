//! Checks the examples on docs/cdsl.md.

use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

const PAGE: &str = include_str!("../../../docs/cdsl.md");

#[test]
fn every_file_on_the_page_is_valid() {
    let files: Vec<&str> = PAGE.split("```cdsl\n").skip(1).collect();
    assert!(!files.is_empty());
    let shipped = |name: &str, text: &'static str| (name.to_owned(), text);
    let interfaces = [
        shipped(
            "Laser.idsl",
            include_str!("../../../components/interfaces/Laser.idsl"),
        ),
        shipped(
            "GenericBase.idsl",
            include_str!("../../../components/interfaces/GenericBase.idsl"),
        ),
        shipped(
            "DifferentialRobot.idsl",
            include_str!("../../../components/interfaces/DifferentialRobot.idsl"),
        ),
        shipped(
            "FullPoseEstimation.idsl",
            include_str!("../../../components/interfaces/FullPoseEstimation.idsl"),
        ),
        shipped(
            "FullPoseEstimationPub.idsl",
            include_str!("../../../components/interfaces/FullPoseEstimationPub.idsl"),
        ),
    ];
    let loader = MemoryLoader::new(interfaces.iter().map(|(name, text)| (name.as_str(), *text)));
    for text in files {
        let text = text.split("```").next().unwrap_or_default();
        let mut sources = SourceMap::new();
        let source = sources.add("page.cdsl", text);
        let (component, found) = rc_cdsl::load(&mut sources, &loader, source);
        assert_eq!(render(&sources, &found, Format::Short), "", "{text}");
        assert!(component.is_some());
    }
}
