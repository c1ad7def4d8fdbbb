//! The `gui` clause of a component: the window of its worker.

use crate::model::Window;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_syntax::Name;

const QT: &str = "Qt";
/// A toolkit for which nothing is generated.
const EGUI: &str = "egui";
/// The classes of Qt that a window may be, the default first.
const WIDGETS: [&str; 3] = ["QWidget", "QDialog", "QMainWindow"];

/// Resolves the clause. Reports what is wrong to `found`.
pub(crate) fn window(
    word: &Name,
    toolkit: &Name,
    widget: Option<&Name>,
    language: Option<&Name>,
    found: &mut Diagnostics,
) -> Option<Window> {
    let is = |known: &str| known.eq_ignore_ascii_case(&toolkit.text);
    if !is(QT) && !is(EGUI) {
        let message = format!("unknown GUI toolkit `{}`", toolkit.text);
        let error = Diagnostic::error("unknown-gui", toolkit.span, message);
        found.push(error.suggest(&toolkit.text, [QT, EGUI]));
    }
    let class = match widget {
        None => Some(WIDGETS[0]),
        Some(widget) => {
            let mut known = WIDGETS.into_iter();
            let class = known.find(|known| known.eq_ignore_ascii_case(&widget.text));
            if class.is_none() {
                let message = format!("unknown widget `{}`", widget.text);
                let error = Diagnostic::error("unknown-widget", widget.span, message);
                found.push(error.suggest(&widget.text, WIDGETS));
            }
            class
        }
    };
    if is(EGUI) {
        let message = "`gui egui` has no effect yet: it is only checked";
        found.push(Diagnostic::warning("not-generated-yet", word.span, message));
    }
    if !is(QT) {
        return None;
    }
    if let Some(language) = language.filter(|language| language.text == "rust") {
        let message = "workers in Rust have no window of Qt";
        let help = "write the component with the window in C++ or Python (`language cpp;`), \
                    or show the tree of this one with `options InnerModelViewer;`, \
                    write on a terminal, or serve a page";
        let error = Diagnostic::error("gui-in-rust", word.span, message);
        let error = error.label(language.span, "the language of this component");
        found.push(error.help(help));
        return None;
    }
    class.map(|widget| Window { widget })
}
