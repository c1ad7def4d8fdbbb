//! The templates of a language, as Tera reads them.

use tera::Tera;

/// Templates of a folder: the name of each, which is that of its file without `.tera`, and its
/// text.
macro_rules! templates {
    ($folder:literal: $($name:literal),* $(,)?) => {
        &[$((
            $name,
            include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/templates/",
                $folder,
                "/",
                $name,
                ".tera"
            )),
        )),*]
    };
}

pub(crate) use templates;

/// A template that does not fit the view: a fault of this program, never of its input.
#[derive(Clone, Debug, thiserror::Error)]
#[error("rcgen's own templates failed, please report it: {0}")]
pub struct TemplateError(String);

impl TemplateError {
    pub(crate) fn new(message: String) -> Self {
        Self(message)
    }
}

impl From<tera::Error> for TemplateError {
    fn from(error: tera::Error) -> Self {
        let mut message = error.to_string();
        let mut source = std::error::Error::source(&error);
        while let Some(inner) = source {
            message = format!("{message}: {inner}");
            source = inner.source();
        }
        Self(message)
    }
}

/// Reads the templates of a language.
pub(crate) fn tera(templates: &[(&str, &str)]) -> Result<Tera, TemplateError> {
    let mut tera = Tera::default();
    tera.autoescape_on(Vec::<&str>::new());
    // Some are parts of others: no file's last line feed is one of its text.
    let templates = templates.iter();
    tera.add_raw_templates(templates.map(|(name, text)| (*name, text.trim_end())))?;
    Ok(tera)
}
