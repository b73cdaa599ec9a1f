//! What a robot file says of itself: where its numbers are from, and how its maker's controller counts joints. Nothing is computed from it.

use super::place::DocumentNode;
use crate::robot::{Bound, CountedCoupling};
use crate::units::Unit;

/// The map `about` of a robot file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// As the maker publishes it, m.
    pub reach: Option<f64>,
    /// Where the numbers are from.
    pub(crate) sources: Vec<String>,
    /// What is left out or differs between sources, a sentence each.
    pub(crate) notes: Vec<String>,
    /// Joints that the controller reports with a part of another one, as `coupled` of `ingest` has them.
    pub coupled: Vec<CountedCoupling>,
}

impl About {
    /// What `ingest` must be told of the controller's counting, as settings of `q`; none where it counts as the robot file does.
    pub fn counting(&self) -> Option<String> {
        let one = |c: &CountedCoupling| {
            format!(
                "{{joint: {}, by: {}, ratio: {}}}",
                c.joint + 1,
                c.by + 1,
                c.ratio
            )
        };
        let all: Vec<String> = self.coupled.iter().map(one).collect();
        (!all.is_empty()).then(|| format!("coupled: [{}]", all.join(", ")))
    }
}

pub(super) fn read(value: DocumentNode, joints: usize, length: Unit) -> About {
    if value.given().is_none() {
        return About::default();
    }
    let value = value.map(&["reach", "sources", "notes", "counting"]);
    let texts = |key: &str| {
        value.get(key).given().map_or_else(Vec::new, |list| {
            list.items()
                .iter()
                .map(DocumentNode::text)
                .collect::<Vec<_>>()
        })
    };
    let coupled = value
        .get("counting")
        .given()
        .map_or_else(Vec::new, |counting| {
            let list = counting.clone().map(&["coupled"]).get("coupled").items();
            list.into_iter()
                .filter_map(|one| coupling(one, joints))
                .collect()
        });
    let reach = value
        .get("reach")
        .given()
        .map(|reach| reach.sized(Bound::Length, length));
    About {
        reach,
        sources: texts("sources"),
        notes: texts("notes"),
        coupled,
    }
}

fn coupling(value: DocumentNode, joints: usize) -> Option<CountedCoupling> {
    let value = value.map(&["joint", "by", "ratio"]);
    let ratio = value.get("ratio").sized(Bound::Factor, Unit::One);
    Some(CountedCoupling {
        joint: value.get("joint").joint(joints)?,
        by: value.get("by").joint(joints)?,
        ratio,
    })
}
