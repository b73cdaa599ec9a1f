//! Every table, from the schemas.

use super::blocks::cell;
use calib::store::schema::all;

pub fn text() -> String {
    let mut text = String::from("| table | version | key | holds |\n|---|---|---|---|\n");
    for table in all() {
        text.push_str(&format!(
            "| [{0}]({0}.json) | {1} | `{2}` | {3} |\n",
            table.name,
            table.version,
            table.primary_key.join("`, `"),
            cell(&table.description)
        ));
    }
    text
}
