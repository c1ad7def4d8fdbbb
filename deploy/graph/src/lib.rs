//! A network as a picture: its components, hosts and groups, who talks to whom, and what is wrong
//! with which of them.
//!
//! `model` is what `--format json` prints; `svg`, `mermaid` and `dot` draw it.

mod build;
mod dot;
mod marks;
mod mermaid;
mod model;
mod outline;
mod svg;
mod text;

pub use model::{Component, Finding, Graph, Group, Slot};

/// In which form a network is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GraphFormat {
    /// A picture that needs no other program.
    Svg,
    /// Text for Mermaid, which Markdown pages show as a picture.
    Mermaid,
    /// Text for Graphviz.
    Dot,
    /// One document for programs.
    Json,
}

impl std::str::FromStr for GraphFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "svg" => Ok(Self::Svg),
            "mermaid" => Ok(Self::Mermaid),
            "dot" => Ok(Self::Dot),
            "json" => Ok(Self::Json),
            other => Err(format!(
                "`{other}` is not a format; there are svg, mermaid, dot and json"
            )),
        }
    }
}

impl Graph {
    /// The picture as text that ends in a line feed.
    pub fn draw(&self, format: GraphFormat) -> Result<String, serde_json::Error> {
        Ok(match format {
            GraphFormat::Svg => svg::draw(self),
            GraphFormat::Mermaid => mermaid::draw(self),
            GraphFormat::Dot => dot::draw(self),
            GraphFormat::Json => serde_json::to_string_pretty(self)? + "\n",
        })
    }
}
