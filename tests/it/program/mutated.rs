//! Listings of FANUC's and scripts of Universal Robots with bytes changed: refused, or nothing but numbers of targets changes.

use super::random::unchanged;
use super::{Program, moved};
use calib::program::{Language, Partial};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

const SEED: u64 = 20_261_127;
const PROGRAMS: usize = 50;
const CHANGES: usize = 40;
const BYTES: &[u8] = b" ,.;:{}[]()-+eE0123456789JPXWpq_\"'!#\n\r\t=\xC3\x00";

fn fanuc(rng: &mut ChaCha8Rng) -> String {
    let mut text = String::from("/PROG  A\n/ATTR\nCOMMENT = \"a 'b\";\n/MN\n");
    let count = rng.random_range(1..5);
    (1..=count).for_each(|k| text.push_str(&format!("{k:4}:L P[{k}] 100mm/sec FINE    ;\n")));
    text.push_str("/POS\n");
    for k in 1..=count {
        let mut n =
            |most: f64| format!("{:9.3}", rng.random_range(-most..most)).replace("-0.", "-.");
        if k % 2 == 0 {
            let joints: Vec<String> = (1..=6)
                .map(|j| format!("\tJ{j}= {} deg", n(170.0)))
                .collect();
            text.push_str(&format!(
                "P[{k}]{{\n   GP1:\n\tUF : 0, UT : 1,\t\n{}\n}};\n",
                joints.join(",\n")
            ));
        } else {
            let (place, turn) = (
                [n(900.0), n(900.0), n(900.0)],
                [n(180.0), n(180.0), n(180.0)],
            );
            text.push_str(&format!(
                "P[{k}:\"p {k}\"]{{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'F D T, 0, {}, 0',\n\tX = {} mm,\tY = {} mm,\tZ = {} mm,\n\tW = {} deg,\tP = {} deg,\tR = {} deg\n}};\n",
                k - 2,
                place[0],
                place[1],
                place[2],
                turn[0],
                turn[1],
                turn[2]
            ));
        }
    }
    text + "/END\n"
}

fn script(rng: &mut ChaCha8Rng) -> String {
    let mut text = String::from("def a():\n  set_tcp(p[0,0,0.1,0,0,0]) # p[\n");
    for k in 0..rng.random_range(1..5) {
        let mut six = |most: f64| {
            (0..6)
                .map(|_| format!("{:.4}", rng.random_range(-most..most)))
                .collect::<Vec<_>>()
                .join(", ")
        };
        text.push_str(&format!(
            "  q{k} = [{}]\n  global w{k}=p[{}]\n",
            six(3.0),
            six(1.0)
        ));
        text.push_str(&format!(
            "  movej(q{k}, a=1.4, v=1.05)\n  movel(w{k}, a=1.2)\n  movej([{}])\n",
            six(3.0)
        ));
        text.push_str(&format!(
            "  movep(p[{}], a=1.2, r=0.05)\n  textmsg(\"[1,2,3,4,5,6\")\n",
            six(1.0)
        ));
    }
    text + "end\n"
}

#[test]
fn a_listing_or_a_script_with_bytes_changed_is_refused_or_read_as_it_stands() {
    for (language, made) in [
        (Language::Fanuc, fanuc as fn(&mut ChaCha8Rng) -> String),
        (Language::UrScript, script),
    ] {
        let mut accepted = 0;
        for k in 0..PROGRAMS as u64 {
            let mut rng = ChaCha8Rng::seed_from_u64(SEED + k);
            let text = made(&mut rng).into_bytes();
            let plain = Program::parse(&text, language, Partial::Refused);
            let plain = plain.unwrap_or_else(|refusal| {
                panic!("{}\n{:?}", String::from_utf8_lossy(&text), refusal.faults)
            });
            assert!(!plain.literals().is_empty() && moved(&plain, 0.0) == text);
            for _ in 0..CHANGES {
                let mut changed = text.clone();
                for _ in 0..rng.random_range(1..3) {
                    let (at, byte) = (
                        rng.random_range(0..changed.len()),
                        BYTES[rng.random_range(0..BYTES.len())],
                    );
                    match rng.random_range(0..3) {
                        0 => drop(changed.remove(at)),
                        1 => changed[at] = byte,
                        _ => changed.insert(at, byte),
                    }
                }
                let Ok(program) = Program::parse(&changed, language, Partial::Refused) else {
                    continue;
                };
                accepted += 1;
                let shown = String::from_utf8_lossy(&changed);
                assert_eq!(moved(&program, 0.0), changed, "{shown}");
                let out = moved(&program, 1e-3);
                let again = Program::parse(&out, language, Partial::Refused)
                    .unwrap_or_else(|refusal| panic!("{shown}\n{:?}", refusal.faults));
                assert_eq!(
                    unchanged(&out, &again),
                    unchanged(&changed, &program),
                    "{shown}"
                );
                assert_eq!(again.literals().len(), program.literals().len(), "{shown}");
                for (new, old) in again.literals().iter().zip(program.literals()) {
                    let near = |(new, old): (&f64, &f64)| {
                        (new - old - 1e-3).abs() <= 5e-6 + 1e-12 * old.abs()
                    };
                    assert!(
                        new.values.iter().zip(&old.values).all(near) && new.posture == old.posture,
                        "{shown}"
                    );
                }
            }
        }
        let share = f64::from(accepted) / (PROGRAMS * CHANGES) as f64;
        println!(
            "{language:?}: {accepted} of {} changed programs accepted",
            PROGRAMS * CHANGES
        );
        assert!((0.1..0.95).contains(&share), "{share}");
    }
}
