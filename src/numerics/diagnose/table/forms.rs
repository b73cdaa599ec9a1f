//! The forms of one name at one place: what poses are to separate from a finding.

use super::cell::{CauseCell, FreeShape, Shapes};
use super::{generated, listed};
use crate::diagnose::types::Question;
use crate::diagnose::whitened::WhitenedProblem;
use crate::effect::{Form, Place, Survey, names};
use std::collections::BTreeSet;

/// The forms of a name at a place as a search looks at them first, one at a time; where there are none, all places of that name.
pub(crate) fn forms_of(
    (name, place): (&str, Place),
    question: &Question,
    survey: &Survey,
    problem: &WhitenedProblem,
) -> Result<Vec<Form>, BTreeSet<Place>> {
    let values = |variable| problem.values(variable);
    let (cells, places): (Vec<CauseCell>, BTreeSet<Place>) = if name == names::UNKNOWN {
        (
            unnamed(place, survey),
            generated::places(survey).into_iter().collect(),
        )
    } else {
        let cell_name = if name == names::JOINT_HARDENING {
            names::JOINT_COMPLIANCE
        } else {
            name
        };
        let mut cells = listed::cells(survey, &values, question);
        cells.retain(|cell| cell.name == cell_name);
        let places = cells.iter().map(|cell| cell.place).collect();
        (cells, places)
    };
    let groups = cells
        .iter()
        .filter(|cell| cell.place == place)
        .flat_map(|cell| cell.groups(survey, &values, false));
    let one_by_one = groups
        .filter(|group| name == names::UNKNOWN || group.forms.len() == 1)
        .flat_map(|group| group.forms);
    // A joint yields to its load in one way: in proportion, or not.
    let bends = [names::JOINT_COMPLIANCE, names::JOINT_HARDENING].contains(&name);
    let forms: Vec<Form> = one_by_one
        .filter(|form| !bends || form.name() == name)
        .collect();
    if forms.is_empty() {
        Err(places)
    } else {
        Ok(forms)
    }
}

/// The cells without a name at a place.
fn unnamed(place: Place, survey: &Survey) -> Vec<CauseCell> {
    let mut out = Vec::new();
    for motion in generated::families(place, survey)
        .into_iter()
        .flatten()
        .filter(|motion| motion.place() == place)
    {
        for (variable, over) in generated::kinds(place, motion, survey)
            .into_iter()
            .flatten()
        {
            if !generated::is_listed(motion, variable, over, survey) {
                let shapes = Shapes::Free(FreeShape {
                    motion,
                    variable,
                    over,
                });
                out.push(CauseCell {
                    name: names::UNKNOWN,
                    place,
                    key: String::new(),
                    log_prior: 0.0,
                    shapes,
                    between: None,
                });
            }
        }
    }
    out
}
