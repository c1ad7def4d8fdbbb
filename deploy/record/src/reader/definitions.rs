//! The channels of a recording and their types, within a bound.

use super::Channel;
use rc_diagnostics::foreign::clean;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::hash::{BuildHasher, Hash, Hasher, RandomState};
use std::sync::Arc;

/// The most bytes of definitions, of tables and of names of attachments that a recording may have.
/// Readers keep them all.
const MOST: usize = 64 << 20;
/// Approximate memory of a definition in addition to its bytes.
const OVERHEAD: usize = 512;
/// Approximate memory of an entry of a table in addition to its bytes.
const ENTRY: usize = 128;

/// A type: its name, the encoding of its definition, and the definition.
#[derive(Debug, PartialEq, Eq, Hash)]
struct Schema {
    name: String,
    encoding: String,
    data: Arc<[u8]>,
}

/// The channels of a recording. A channel that several files have, or that a file repeats, is one.
#[derive(Default)]
pub(super) struct Definitions {
    /// Schemas of the present file, by their numbers in it.
    schemas: BTreeMap<u16, Arc<Schema>>,
    channels: BTreeMap<u16, Arc<Channel>>,
    /// Schemas and channels of all files.
    all_schemas: HashSet<Arc<Schema>>,
    all: Vec<Arc<Channel>>,
    by_hash: HashMap<u64, Vec<Arc<Channel>>>,
    hasher: RandomState,
    held: usize,
}

impl Definitions {
    /// Forgets the numbers of the present file.
    pub(super) fn next_file(&mut self) {
        self.schemas.clear();
        self.channels.clear();
    }

    /// The channels so far, of all files.
    pub(super) fn all(&self) -> &[Arc<Channel>] {
        &self.all
    }

    /// The channel with this number in the present file.
    pub(super) fn channel(&self, id: u16) -> Option<&Arc<Channel>> {
        self.channels.get(&id)
    }

    /// Counts the memory of a reader. Fails if it is too much.
    pub(super) fn hold(&mut self, bytes: usize, entries: usize) -> Result<(), String> {
        self.held += bytes + OVERHEAD + ENTRY * entries;
        if self.held > MOST {
            return Err(format!(
                "its definitions and tables have more than {} MiB",
                MOST >> 20
            ));
        }
        Ok(())
    }

    pub(super) fn add_schema(
        &mut self,
        id: u16,
        name: &str,
        encoding: &str,
        data: &[u8],
    ) -> Result<(), String> {
        let (name, encoding) = (clean(name), clean(encoding));
        let is_same = |known: &Arc<Schema>| {
            known.name == name && known.encoding == encoding && *known.data == *data
        };
        if self.schemas.get(&id).is_some_and(is_same) {
            return Ok(());
        }
        let schema = Schema {
            name,
            encoding,
            data: data.into(),
        };
        let schema = if let Some(known) = self.all_schemas.get(&schema) {
            Arc::clone(known)
        } else {
            self.hold(data.len(), 0)?;
            let schema = Arc::new(schema);
            self.all_schemas.insert(Arc::clone(&schema));
            schema
        };
        self.schemas.insert(id, schema);
        Ok(())
    }

    pub(super) fn add_channel(
        &mut self,
        id: u16,
        schema: u16,
        topic: &str,
        encoding: &str,
        metadata: BTreeMap<String, String>,
    ) -> Result<(), String> {
        let (type_name, schema_encoding, schema) = match self.schemas.get(&schema) {
            Some(schema) => (
                schema.name.clone(),
                schema.encoding.clone(),
                Arc::clone(&schema.data),
            ),
            None => (String::new(), String::new(), Arc::from([])),
        };
        let mut channel = Channel {
            id: 0,
            topic: clean(topic),
            encoding: clean(encoding),
            type_name,
            schema_encoding,
            schema,
            metadata,
        };
        let is_same = |known: &&Arc<Channel>| is_same(known, &channel);
        if self.channels.get(&id).as_ref().is_some_and(is_same) {
            return Ok(());
        }
        let hash = self.hash(&channel);
        let known = self.by_hash.get(&hash);
        let known = known.and_then(|known| known.iter().find(is_same)).cloned();
        let channel = if let Some(known) = known {
            known
        } else {
            let table = channel.metadata.iter();
            let bytes: usize = table.map(|(key, value)| key.len() + value.len()).sum();
            self.hold(bytes, channel.metadata.len())?;
            channel.id = self.all.len() as u32;
            let channel = Arc::new(channel);
            self.all.push(Arc::clone(&channel));
            let same = self.by_hash.entry(hash).or_default();
            same.push(Arc::clone(&channel));
            channel
        };
        self.channels.insert(id, channel);
        Ok(())
    }

    fn hash(&self, channel: &Channel) -> u64 {
        let mut hasher = self.hasher.build_hasher();
        channel.topic.hash(&mut hasher);
        channel.encoding.hash(&mut hasher);
        channel.type_name.hash(&mut hasher);
        channel.metadata.hash(&mut hasher);
        // Each definition is kept once, so its place identifies it.
        place(&channel.schema).hash(&mut hasher);
        hasher.finish()
    }
}

/// Whether two channels differ in their numbers at most. No definition is compared byte by byte.
fn is_same(one: &Channel, other: &Channel) -> bool {
    place(&one.schema) == place(&other.schema)
        && one.topic == other.topic
        && one.encoding == other.encoding
        && one.type_name == other.type_name
        && one.schema_encoding == other.schema_encoding
        && one.metadata == other.metadata
}

/// Where a definition is. Empty ones have none.
fn place(schema: &Arc<[u8]>) -> usize {
    if schema.is_empty() {
        return 0;
    }
    schema.as_ptr() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_is_kept_has_one_bound() {
        let mut definitions = Definitions::default();
        let rest = MOST - 2 * OVERHEAD - 3 * ENTRY;
        assert_eq!(definitions.hold(0, 3), Ok(()));
        assert_eq!(definitions.hold(rest, 0), Ok(()), "exactly the most");
        let error = "its definitions and tables have more than 64 MiB";
        assert_eq!(definitions.hold(0, 0), Err(error.to_owned()));
        assert!(Definitions::default().hold(MOST - OVERHEAD, 0).is_ok());
        assert!(Definitions::default().hold(MOST - OVERHEAD + 1, 0).is_err());
    }

    #[test]
    fn a_number_means_the_channel_that_came_last() {
        let mut definitions = Definitions::default();
        for (schema, name) in [(1, "A"), (2, "B")] {
            let added = definitions.add_schema(schema, name, "ros2msg", name.as_bytes());
            assert_eq!(added, Ok(()));
        }
        let channels = [
            (1, "/a", "cdr", "1"),
            (1, "/b", "cdr", "1"),
            (1, "/b", "json", "1"),
            (1, "/b", "json", "2"),
            (2, "/b", "json", "2"),
        ];
        // The second time, all are known.
        for _ in 0..2 {
            for (id, (schema, topic, encoding, fact)) in (0..).zip(channels) {
                let metadata = BTreeMap::from([("fact".to_owned(), fact.to_owned())]);
                let added = definitions.add_channel(7, schema, topic, encoding, metadata);
                assert_eq!(added, Ok(()));
                let channel = definitions.channel(7).expect("a channel");
                assert_eq!((channel.id, channel.topic.as_str()), (id, topic));
                assert_eq!(channel.encoding, encoding);
                assert_eq!(channel.get("fact"), Some(fact));
                let type_name = if schema == 1 { "A" } else { "B" };
                assert_eq!(channel.type_name, type_name);
            }
        }
        assert_eq!(definitions.all().len(), channels.len());
    }
}
