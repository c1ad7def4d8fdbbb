//! Simulators whose scenes follow the tree.

use crate::front::changes;
use crate::wire::node_out;
use inner_model_generated::tracing::warn;
use inner_model_generated::{
    Call, CallError, Context, Followed, Member, Nodes, SimulatorsDone, WorkerError,
};
use innermodel::Snapshot;
use rc_diagnostics::foreign::clean;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

/// The time between two requests if nothing changes: a simulator that was started again has nothing of
/// the tree. It is also the pause after a request that failed.
const PERIOD: Duration = Duration::from_secs(1);

/// How many nodes are reported at once.
const MOST_REPORTED: usize = 32;

/// All simulators that the network lists.
pub(crate) struct Simulators(Vec<Simulator>);

struct Simulator {
    member: Member,
    /// The version of the tree that it has. `None`: it needs the whole tree.
    told: Option<Arc<Snapshot>>,
    /// The request that has not ended, and the version of the tree that it brings. Those who use the
    /// tree do not wait for it.
    asked: Option<(Call<Followed, CallError>, Arc<Snapshot>)>,
    /// Ids of nodes that its scene cannot have. They are sent again, because the reason may go.
    unmade: BTreeSet<String>,
    due: Duration,
    has_failed: bool,
}

/// The results wait for the next period.
impl SimulatorsDone for crate::SpecificWorker {}

impl Simulators {
    /// Opens the members that the network lists.
    pub(crate) fn open(ctx: &mut Context) -> Result<Self, WorkerError> {
        // Started by hand, it has none.
        if ctx.simulators.listed().is_some() {
            ctx.simulators.open_listed()?;
        }
        let members = ctx.simulators.members().iter();
        Ok(Self(
            members
                .map(|member| Simulator {
                    member: member.clone(),
                    told: None,
                    asked: None,
                    unmade: BTreeSet::new(),
                    due: Duration::ZERO,
                    has_failed: false,
                })
                .collect(),
        ))
    }

    /// Tells each simulator what has changed since it was told last.
    pub(crate) fn tell(&mut self, ctx: &mut Context, now: Duration, tree: &Arc<Snapshot>) {
        for simulator in &mut self.0 {
            simulator.tell(ctx, now, tree);
        }
    }
}

impl Simulator {
    fn tell(&mut self, ctx: &mut Context, now: Duration, tree: &Arc<Snapshot>) {
        let client = &mut ctx.simulators[&self.member];
        if let Some((call, asked)) = &self.asked {
            let Some(result) = client.take(call) else {
                return;
            };
            let asked = Arc::clone(asked);
            self.asked = None;
            match result {
                Ok(followed) => self.has_answered(followed, asked),
                Err(error) => self.fail(now, &error),
            }
        }
        if !client.is_connected() {
            self.told = None;
            return;
        }
        let is_new = self.told.as_ref().map(|told| told.version()) != Some(tree.version());
        if now < self.due && (self.has_failed || !is_new) {
            return;
        }
        self.due = now + PERIOD;
        let (removed, nodes) = self.news(tree);
        match client.start_follow(self.told.is_none(), &removed, &nodes) {
            Ok(call) => self.asked = Some((call, Arc::clone(tree))),
            Err(error) => self.fail(now, &error),
        }
    }

    fn fail(&mut self, now: Duration, error: &CallError) {
        self.due = now + PERIOD;
        if !std::mem::replace(&mut self.has_failed, true) {
            let name = self.member.name();
            warn!("the simulator `{name}` does not follow: {error}");
        }
    }

    /// Notes what it has of a version of the tree.
    fn has_answered(&mut self, followed: Followed, tree: Arc<Snapshot>) {
        let name = self.member.name();
        self.has_failed = false;
        let (mut unmade, mut new) = (BTreeSet::new(), Vec::new());
        for one in followed.unmade {
            if !self.unmade.contains(&one.id) {
                new.push((clean(&one.id), clean(&one.what)));
            }
            unmade.insert(one.id);
        }
        for (id, what) in new.iter().take(MOST_REPORTED) {
            warn!("the simulator `{name}` does not have `{id}`: {what}");
        }
        if let Some(more @ 1..) = new.len().checked_sub(MOST_REPORTED) {
            warn!("the simulator `{name}` does not have {more} more nodes");
        }
        // The root is no node of the world.
        let all = tree.len() - 1;
        let has_all = usize::try_from(followed.nodes).is_ok_and(|has| has + unmade.len() >= all);
        self.told = has_all.then_some(tree);
        self.unmade = unmade;
    }

    /// The ids of nodes that have gone, and the nodes that have changed.
    fn news(&self, tree: &Snapshot) -> (Vec<String>, Nodes) {
        let Some(told) = &self.told else {
            let nodes = tree.root().subtree().skip(1);
            return (Vec::new(), nodes.map(|node| node_out(&node)).collect());
        };
        let (gone, mut there) = changes(told, tree);
        let again = self.unmade.iter().filter_map(|id| tree.node(id).ok());
        there.extend(again);
        there.sort_by_key(|node| (node.depth(), node.node_id()));
        there.dedup_by_key(|node| node.node_id());
        (gone, there.iter().map(node_out).collect())
    }
}
