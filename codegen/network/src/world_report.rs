//! The world of a network, for the preview and the picture.

use crate::keeper;
use crate::model::Network;
use rc_cdsl::model::Write;
use rc_vocabulary::duration;
use serde::Serialize;
use std::fmt;

/// The graph that components of a network share.
#[derive(Clone, Debug, Serialize)]
pub struct WorldReport {
    /// Name of the world.
    pub name: String,
    /// The schema, as written.
    pub schema: String,
    /// The file with its initial contents, as written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<String>,
    /// The file that keeps it, as written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep: Option<String>,
    /// How often it is kept, in milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep_ms: Option<u64>,
    /// The components that share it, in the order of the network.
    pub members: Vec<WorldMember>,
}

/// A component that shares the world.
#[derive(Clone, Debug, Serialize)]
pub struct WorldMember {
    /// The full name of the component.
    pub component: String,
    /// The name of the world in the worker.
    pub name: String,
    /// The types and attributes that it sets, as in its file. `None` for everything.
    pub writes: Option<Vec<String>>,
    /// The types of which it gets each change. `None` for everything.
    pub reads: Option<Vec<String>>,
}

impl WorldReport {
    /// The world of a network, if it has one.
    pub fn of(network: &Network) -> Option<Self> {
        let world = network.deployment.world.as_ref()?;
        let instances = network.deployment.instances.iter();
        let members = instances
            .zip(&network.projects)
            .zip(&network.parameters)
            .filter_map(|((instance, project), parameters)| {
                let project = project.as_ref()?;
                let clause = project.component.world.as_ref()?;
                let access = clause.access.as_ref();
                let takes_part = keeper::takes_part(clause, parameters.values.as_ref());
                takes_part.then(|| WorldMember {
                    component: instance.path.clone(),
                    name: clause.name.text.clone(),
                    writes: access.map(|access| access.writes.iter().map(written).collect()),
                    reads: access.map(|access| {
                        let reads = access.reads.iter();
                        reads.map(|kind| kind.text.clone()).collect()
                    }),
                })
            });
        let text = |name: &rc_syntax::Name| name.text.clone();
        let keep = world.keep.as_ref();
        Some(Self {
            name: world.name.text.clone(),
            schema: world.schema.as_ref().map(text).unwrap_or_default(),
            start: world.start.as_ref().map(text),
            keep: keep.map(|(file, _)| text(file)),
            keep_ms: keep.map(|(_, time)| time.as_millis().try_into().unwrap_or(u64::MAX)),
            members: members.collect(),
        })
    }
}

/// The attributes that a component sets, as in its file.
fn written(write: &Write) -> String {
    let mut text = write.path();
    if let Some(least) = write.stream {
        text += " stream";
        if !least.is_zero() {
            text += &format!(" {}", duration::text_of(least));
        }
    }
    if write.shared {
        text += " shared";
    }
    text
}

impl fmt::Display for WorldMember {
    /// `writes door; reads room, robot`, `writes nothing`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(writes), Some(reads)) = (&self.writes, &self.reads) else {
            return f.write_str("writes and reads everything");
        };
        let words = [("writes", writes), ("reads", reads)];
        let words = words.iter().filter(|(_, all)| !all.is_empty());
        let words: Vec<String> = words
            .map(|(word, all)| format!("{word} {}", all.join(", ")))
            .collect();
        if words.is_empty() {
            return f.write_str("writes nothing");
        }
        f.write_str(&words.join("; "))
    }
}

impl fmt::Display for WorldReport {
    /// A paragraph for people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "world {}: {}", self.name, self.schema)?;
        if let Some(start) = &self.start {
            write!(f, ", begins with {start}")?;
        }
        if let (Some(keep), Some(ms)) = (&self.keep, self.keep_ms) {
            let time = duration::text(ms.saturating_mul(1_000_000));
            write!(f, ", kept in {keep} every {time}")?;
        }
        writeln!(f)?;
        let widths = self.members.iter();
        let width = widths.map(|member| member.component.chars().count().min(64));
        let width = width.max().unwrap_or(0);
        for member in &self.members {
            writeln!(f, "    {:width$}  {member}", member.component)?;
        }
        Ok(())
    }
}
