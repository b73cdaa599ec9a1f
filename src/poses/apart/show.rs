//! What the poses promise of a finding beside its rival, as text and as JSON.

use super::Apart;
use crate::diagnose::other_means;
use crate::error::counted;
use crate::estimate::choose::{Discrimination, MIN_SEPARATION_L};
use crate::poses::show::closing;
use crate::poses::{Drive, PoseAnswer, drive};
use serde_json::{Value, json};

/// Nobody measures more poses than these.
const MOST: f64 = 10_000.0;

impl Apart<'_> {
    /// Finding and rival in words.
    fn names(&self) -> [String; 2] {
        [
            format!("{} at {}", self.finding.effect, self.finding.place),
            format!("{} at {}", self.rival.0, self.rival.1),
        ]
    }

    /// What becomes of it, a sentence a line.
    fn conclusion(&self) -> Vec<String> {
        let [finding, rival] = self.names();
        let other = other_means(&self.finding.effect, &self.rival.0);
        let Discrimination {
            before,
            alike,
            proposed,
        } = &self.told;
        let Some(proposed) = proposed else {
            let means =
                other.unwrap_or("measure something else: another payload, another temperature, a second target off the first");
            return vec![
                format!(
                    "no pose separates {finding} from {rival}: they move the point identically at every pose"
                ),
                format!("instead: {means}"),
            ];
        };
        let mut out = Vec::new();
        for (k, (true_one, fitted)) in [(&finding, &rival), (&rival, &finding)]
            .into_iter()
            .enumerate()
        {
            if alike[k] {
                out.push(format!("{fitted} can imitate {true_one} completely: only if {fitted} is true are they separable"));
            }
        }
        // What can show at all must.
        let least = |l: &[f64; 2]| {
            (0..2)
                .filter(|k| !alike[*k])
                .map(|k| l[k])
                .fold(f64::INFINITY, f64::min)
        };
        let (was, will, count) = (least(before), least(&proposed.after), proposed.poses.rows());
        if will >= MIN_SEPARATION_L {
            let already = if was >= MIN_SEPARATION_L {
                "; the recording alone should do"
            } else {
                ""
            };
            out.push(format!(
                "measured at {}, they are separable{already}",
                counted(count, "pose")
            ));
        } else {
            let needed = ((MIN_SEPARATION_L - was) / (will - was) * count as f64).ceil();
            let more = if needed < MOST {
                format!("some {needed:.0} such poses would")
            } else {
                "no number of poses would".into()
            };
            let size = if alike.contains(&true) {
                ", if the effect is as large as this recording estimates"
            } else {
                ""
            };
            out.push(format!(
                "measured at {}, they are not separable: {more}{size}",
                counted(count, "pose")
            ));
            out.extend(other.map(|means| format!("instead: {means}")));
        }
        out
    }
}

impl PoseAnswer for Apart<'_> {
    fn drive(&self) -> Option<Drive<'_>> {
        let proposed = self.told.proposed.as_ref()?;
        let Self {
            robot,
            ranges,
            convention,
            ..
        } = self;
        Some(Drive {
            robot,
            ranges,
            poses: &proposed.poses,
            direction: &proposed.direction,
            convention,
        })
    }

    fn text(&self) -> String {
        let names = self.names();
        let mut text = format!(
            "finding {}: {}\nrival: {}\n",
            self.finding.rank, self.finding.statement, names[1]
        );
        text.push_str(&format!(
            "\nexpected separation L: squared residual over noise variance when the other is fitted in its place; below {MIN_SEPARATION_L} they\n\
             cannot be separated. Points good to {:.3} mm per axis\n",
            self.sigma
        ));
        let count = self
            .told
            .proposed
            .as_ref()
            .map_or(0, |proposed| proposed.poses.rows());
        let mut rows = vec![(
            format!("the recording, {}", counted(self.rows, "point")),
            self.told.before,
        )];
        if let Some(proposed) = &self.told.proposed {
            rows.push((
                format!("and {count} random poses, median of 200"),
                proposed.random,
            ));
            rows.push((format!("and the {count} proposed"), proposed.after));
        }
        let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        let heads = names.map(|name| format!("if {name}"));
        text.push_str(&format!("  {:width$}  {}  {}\n", "", heads[0], heads[1]));
        for (name, l) in rows {
            text.push_str(&format!(
                "  {name:width$}  {:>2$.1}  {:>3$.1}\n",
                l[0],
                l[1],
                heads[0].len(),
                heads[1].len()
            ));
        }
        text.push('\n');
        self.conclusion()
            .iter()
            .for_each(|line| text.push_str(&format!("{line}\n")));
        if self.told.proposed.is_some() {
            text.push_str("measure in the same set-up, with tracker and target left in place");
            if let Some(temperature) = self.circumstances.temperature {
                text.push_str(&format!(", the arm at {temperature:.1} C"));
            }
            text.push_str(
                "; append the files under `later` of the stage `ingest` and diagnose again;\n",
            );
            text.push_str(&format!(
                "to see what that decided: calib diff {} NEW_RUN\n",
                self.run
            ));
            if !self.convention.is_of_the_robot_file() {
                let counting = drive::counting(&self.convention, &self.robot);
                text.push_str(&format!(
                    "joints and directions of the poses are counted as at the {counting}\n"
                ));
            }
            text.push_str(&closing(self.request));
        }
        text
    }

    fn document(&self) -> Value {
        let names = self.names();
        let Discrimination {
            before,
            alike,
            proposed,
        } = &self.told;
        let separation = [0, 1].map(|k: usize| {
            json!({
                "if": names[k], "fitted": names[1 - k], "recorded": before[k], "imitated": alike[k],
                "random": proposed.as_ref().map(|proposed| proposed.random[k]),
                "proposed": proposed.as_ref().map(|proposed| proposed.after[k]),
            })
        });
        json!({
            "robot": self.robot.name,
            "run": self.run,
            "seed": self.request.seed,
            "finding": { "rank": self.finding.rank, "effect": self.finding.effect, "where": self.finding.place },
            "rival": { "effect": self.rival.0, "where": self.rival.1.to_string(), "form": self.form },
            "sigma_mm": self.sigma,
            "temperature_c": self.circumstances.temperature,
            "points": self.rows,
            "told_from": MIN_SEPARATION_L,
            "separation": separation,
            "conclusion": self.conclusion(),
            "approach_visible_share": proposed.as_ref().map(|proposed| proposed.approach_seen),
            "self_collision_checked": false,
            "counting": drive::counting(&self.convention, &self.robot),
            "out": self.request.out.as_ref().map(|out| out.to_string_lossy()),
            "poses": self.drive().map_or_else(Vec::new, |poses| drive::objects(&poses)),
        })
    }
}
