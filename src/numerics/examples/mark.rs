use calib_numerics::dynamics::*;
use nalgebra::{Matrix3, Point3, Vector3};
use serde_json::{Value, json};
fn folder(dir: &std::path::Path) -> TorqueDiagnosis {
    let read = |name: &str| std::fs::read_to_string(dir.join(name)).unwrap();
    let r: Value = serde_json::from_str(&read("robot.json")).unwrap();

    let v = |x: &Value| -> Vec<f64> { x.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect() };
    let m3 = |x: &Value| -> [f64; 3] {
        let a = v(x);
        [a[0] / 1e3, a[1] / 1e3, a[2] / 1e3]
    };
    let list = |k: &str| r[k].as_array().unwrap().clone();
    let n = list("axes").len();
    let inertial = |mass: f64, centre: [f64; 3], m: &[f64]| Inertial {
        mass,
        centre: Point3::from(centre),
        inertia: Matrix3::new(m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5]),
    };
    let tool = m3(&r["tool"]);
    let off = m3(&r["payload_com"]);
    let arm = DynamicArm {
        axes: list("axes")
            .iter()
            .map(|a| {
                let a = v(a);
                Vector3::new(a[0], a[1], a[2])
            })
            .collect(),
        points: list("points").iter().map(|p| Point3::from(m3(p))).collect(),
        prismatic: vec![false; n],
        tool: Point3::from(tool),
        links: Some((0..n).map(|k| inertial(r["mass"][k].as_f64().unwrap(), m3(&r["com"][k]), &v(&r["inertia"][k]))).collect()),
        payload: Some(inertial(
            r["payload"].as_f64().unwrap(),
            [tool[0] + off[0], tool[1] + off[1], tool[2] + off[2]],
            &v(&r["payload_inertia"]),
        )),
        gravity: {
            let g = v(&r["gravity"]);
            Vector3::new(g[0], g[1], g[2])
        },
        ratio: v(&r["ratio"]),
        coupled: vec![],
        tolerance: InertialTolerance { mass_relative: 0.01, centre: 0.004, inertia_relative: 0.05 },
    };
    let f: Vec<f64> = v(&r["ratio"]).iter().zip(v(&r["kt"])).map(|(a, b)| a * b).collect();
    let text = read("recording.csv");
    let mut rec = TorqueRecording {
        joints: n,
        time: vec![],
        position: vec![],
        velocity: None,
        torque: vec![],
        temperature: None,
        trajectory: vec![],
        held_out: vec![],
        from_current: true,
    };
    for line in text.lines().skip(1) {
        let c: Vec<&str> = line.split(',').collect();
        rec.time.push(c[0].parse().unwrap());
        rec.trajectory.push(c[1].parse().unwrap());
        rec.held_out.push(c[2] != "fit");
        for j in 0..n {
            rec.position.push(c[3 + j].parse::<f64>().unwrap().to_radians());
            rec.torque.push(c[3 + n + j].parse::<f64>().unwrap() * f[j]);
        }
    }
    let d = diagnose(&arm, &rec, &TorqueQuestion { seed: 1, ..Default::default() }, &mut |line| eprintln!("{line}")).unwrap();
    d
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let d = folder(std::path::Path::new(&args[1]));
    let list: Vec<Value> = d.findings.iter().map(|f| json!({"effect": f.effect, "where": f.place.to_string(), "gain": f.evidence.gain, "rms": f.evidence.effect_rms, "statement": f.statement,
        "rivals": f.rivals.iter().map(|r| json!({"effect": r.effect, "where": r.place.to_string(), "delta": r.delta_bic})).collect::<Vec<_>>()})).collect();
    eprintln!("{:?}", d.remarks);
    if let Some(csv) = args.get(2) {
        let c = &d.courses;
        let n = c.measured.len() / c.row.len();
        let mut out = String::new();
        for r in 0..c.row.len() {
            out += &format!("{},{},{}", c.time[r], c.held_out[r], c.in_event[r]);
            for j in 0..n {
                out += &format!(
                    ",{},{},{},{}",
                    c.velocity[r * n + j],
                    c.measured[r * n + j],
                    c.simulated[r * n + j],
                    c.corrected[r * n + j]
                );
            }
            out += "\n";
        }
        std::fs::write(csv, out).unwrap();
    }
    println!("{}", json!({"findings": list}));
}
