//! Draws a network: components, hosts, groups, connections and findings.
//!
//! `model` is what `--format json` prints; `svg`, `mermaid` and `dot` draw it.

mod build;
mod dot;
mod marks;
mod mermaid;
mod model;
mod outline;
mod svg;

pub use model::{Component, Finding, Graph, Group, Live, Slot};

/// The form of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GraphFormat {
    /// An SVG document.
    Svg,
    /// Text for Mermaid, for Markdown pages.
    Mermaid,
    /// Text for Graphviz.
    Dot,
    /// One JSON document.
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
    /// Returns the picture as text that ends with a line feed.
    pub fn draw(&self, format: GraphFormat) -> Result<String, serde_json::Error> {
        Ok(match format {
            GraphFormat::Svg => svg::draw(self),
            GraphFormat::Mermaid => mermaid::draw(self),
            GraphFormat::Dot => dot::draw(self),
            GraphFormat::Json => serde_json::to_string_pretty(self)? + "\n",
        })
    }
}
