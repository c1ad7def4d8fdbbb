//! Publishers, subscribers and servers, as clients draw them.

use serde_json::{Value as Json, json};
use std::collections::{BTreeMap, BTreeSet};

/// Publishers and subscribers of topics, and servers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Graph {
    pub(crate) published: Names,
    pub(crate) subscribed: Names,
    pub(crate) services: Names,
}

/// Components by topic or service.
type Names = BTreeMap<String, BTreeSet<String>>;

impl Graph {
    /// The message that leads from this graph to another one.
    pub(crate) fn update_to(&self, new: &Self) -> Option<Json> {
        let list = |old: &Names, new: &Names, ids: &str| {
            let changed = new
                .iter()
                .filter(|(name, ends)| old.get(*name) != Some(ends));
            let changed = changed.map(|(name, ends)| {
                let mut entry = json!({"name": name});
                entry[ids] = json!(ends);
                entry
            });
            changed.collect::<Vec<Json>>()
        };
        let published = list(&self.published, &new.published, "publisherIds");
        let subscribed = list(&self.subscribed, &new.subscribed, "subscriberIds");
        let services = list(&self.services, &new.services, "providerIds");
        let all = |graph: &Self| {
            let names = graph.published.keys().chain(graph.subscribed.keys());
            names.cloned().collect::<BTreeSet<String>>()
        };
        let (before, after) = (all(self), all(new));
        let mut removed: BTreeSet<&String> = before.difference(&after).collect();
        // A topic that has lost one of its sides starts again.
        let (mut published, mut subscribed) = (published, subscribed);
        for name in before.intersection(&after) {
            let has_lost =
                |old: &Names, new: &Names| old.contains_key(name) && !new.contains_key(name);
            if has_lost(&self.published, &new.published) {
                published.push(json!({"name": name, "publisherIds": []}));
            }
            if has_lost(&self.subscribed, &new.subscribed) {
                subscribed.push(json!({"name": name, "subscriberIds": []}));
            }
        }
        removed.retain(|name| !after.contains(*name));
        let gone = self.services.keys();
        let gone = gone.filter(|name| !new.services.contains_key(*name));
        let gone: Vec<&String> = gone.collect();
        let is_same = published.is_empty()
            && subscribed.is_empty()
            && services.is_empty()
            && removed.is_empty()
            && gone.is_empty();
        (!is_same).then(|| {
            json!({
                "op": "connectionGraphUpdate",
                "publishedTopics": published,
                "subscribedTopics": subscribed,
                "advertisedServices": services,
                "removedTopics": removed,
                "removedServices": gone,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(all: &[(&str, &[&str])]) -> Names {
        let all = all.iter();
        all.map(|(name, ends)| {
            let ends = ends.iter().map(|end| (*end).to_owned()).collect();
            ((*name).to_owned(), ends)
        })
        .collect()
    }

    #[test]
    fn a_graph_changes_by_what_is_new_and_what_is_gone() {
        let before = Graph {
            published: names(&[("/a", &["x"]), ("/b", &["x"])]),
            subscribed: names(&[("/a", &["y"])]),
            services: names(&[("/s", &["x"])]),
        };
        assert_eq!(before.update_to(&before), None);
        let after = Graph {
            published: names(&[("/a", &["x", "z"])]),
            subscribed: Names::new(),
            services: Names::new(),
        };
        assert_eq!(
            before.update_to(&after),
            Some(json!({
                "op": "connectionGraphUpdate",
                "publishedTopics": [{"name": "/a", "publisherIds": ["x", "z"]}],
                "subscribedTopics": [{"name": "/a", "subscriberIds": []}],
                "advertisedServices": [],
                "removedTopics": ["/b"],
                "removedServices": ["/s"],
            }))
        );
    }
}
