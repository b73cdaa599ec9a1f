//! The order of a table's rows kept through a query: groups in the order of their first rows, pairs in that of the left table.
//!
//! Left to itself, polars gives groups and pairs in whatever order its threads finish.

use polars::prelude::{DslPlan, JoinType, MaintainOrderJoin, UniqueKeepStrategy};
use std::sync::Arc;

/// The same plan, with every step that may lose the order told to keep it.
pub(super) fn kept(plan: DslPlan) -> DslPlan {
    match plan {
        // What polars noted about a plan while it read the SQL; it does so again.
        DslPlan::IR { dsl, .. } => kept(Arc::unwrap_or_clone(dsl)),
        DslPlan::GroupBy {
            input,
            keys,
            predicates,
            aggs,
            maintain_order: _,
            options,
            apply,
        } => DslPlan::GroupBy {
            input: below(input),
            keys,
            predicates,
            aggs,
            maintain_order: true,
            options,
            apply,
        },
        DslPlan::Join {
            input_left,
            input_right,
            left_on,
            right_on,
            predicates,
            mut options,
        } => {
            let order = match options.args.how {
                JoinType::Inner | JoinType::Left | JoinType::Full => {
                    Some(MaintainOrderJoin::LeftRight)
                }
                JoinType::Right => Some(MaintainOrderJoin::RightLeft),
                JoinType::Semi | JoinType::Anti => Some(MaintainOrderJoin::Left),
                // Every row with every row: in order by themselves.
                _ => None,
            };
            if let Some(order) = order {
                Arc::make_mut(&mut options).args.maintain_order = order;
            }
            let (input_left, input_right) = (below(input_left), below(input_right));
            DslPlan::Join {
                input_left,
                input_right,
                left_on,
                right_on,
                predicates,
                options,
            }
        }
        DslPlan::Distinct { input, mut options } => {
            options.maintain_order = true;
            if matches!(options.keep_strategy, UniqueKeepStrategy::Any) {
                options.keep_strategy = UniqueKeepStrategy::First;
            }
            DslPlan::Distinct {
                input: below(input),
                options,
            }
        }
        DslPlan::Sort {
            input,
            by_column,
            slice,
            mut sort_options,
        } => {
            sort_options.maintain_order = true;
            DslPlan::Sort {
                input: below(input),
                by_column,
                slice,
                sort_options,
            }
        }
        DslPlan::Union { inputs, mut args } => {
            args.maintain_order = true;
            DslPlan::Union {
                inputs: inputs.into_iter().map(kept).collect(),
                args,
            }
        }
        DslPlan::Filter { input, predicate } => DslPlan::Filter {
            input: below(input),
            predicate,
        },
        DslPlan::Select {
            expr,
            input,
            options,
        } => DslPlan::Select {
            expr,
            input: below(input),
            options,
        },
        DslPlan::HStack {
            input,
            exprs,
            options,
        } => DslPlan::HStack {
            input: below(input),
            exprs,
            options,
        },
        DslPlan::Slice { input, offset, len } => DslPlan::Slice {
            input: below(input),
            offset,
            len,
        },
        DslPlan::MapFunction { input, function } => DslPlan::MapFunction {
            input: below(input),
            function,
        },
        DslPlan::Cache { input, id } => DslPlan::Cache {
            input: below(input),
            id,
        },
        other => other,
    }
}

fn below(input: Arc<DslPlan>) -> Arc<DslPlan> {
    Arc::new(kept(Arc::unwrap_or_clone(input)))
}
