//! Four arms, each as screws, standard and modified DH table; the fourth description, a URDF, is in `tests/reference`.

pub struct Arm {
    pub name: &'static str,
    pub screws: &'static str,
    pub screws_tool: &'static str,
    pub dh: &'static str,
    pub mdh: &'static str,
    /// Tool in the last DH frame, which both conventions share in these arms.
    pub dh_tool: &'static str,
}

pub const ARMS: [Arm; 4] = [
    Arm {
        name: "ur10",
        screws: "
    - {axis: [0, 0, 2], point: [0, 0, 40]}
    - {axis: [0, -1, 0], point: [0, 0, 127.3]}
    - {twist: [127.3, 0, 612, 0, -1, 0]}
    - {axis: [0, -1, 0], point: [-1184.3, 5, 127.3]}
    - {kind: revolute, axis: [0, 0, -1], point: [-1184.3, -163.941, 127.3]}
    - {axis: [0, -1, 0], point: [-1184.3, -163.941, 11.6]}",
        screws_tool: "{point: [-1184.3, -256.141, 11.6], orientation: {rpy: [90, 0, 0]}}",
        dh: "
    - {theta: 0, d: 127.3, a: 0, alpha: 90}
    - {theta: 0, d: 0, a: -612, alpha: 0}
    - {theta: 0, d: 0, a: -572.3, alpha: 0}
    - {theta: 0, d: 163.941, a: 0, alpha: 90}
    - {theta: 0, d: 115.7, a: 0, alpha: -90, kind: revolute}
    - {d: 92.2, a: 0, alpha: 0}",
        mdh: "
    - {alpha: 0, a: 0, theta: 0, d: 127.3}
    - {alpha: 90, a: 0, theta: 0, d: 0}
    - {alpha: 0, a: -612, theta: 0, d: 0}
    - {alpha: 0, a: -572.3, theta: 0, d: 163.941}
    - {alpha: 90, a: 0, theta: 0, d: 115.7}
    - {alpha: -90, a: 0, theta: 0, d: 92.2}",
        dh_tool: "{point: [0, 0, 0]}",
    },
    Arm {
        name: "spherical",
        screws: "
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, -1, 0], point: [312, 0, 0]}
    - {axis: [0, -1, 0], point: [312, 0, 1075]}
    - {axis: [1, 0, 0], point: [0, 0, 1310]}
    - {axis: [0, -1, 0], point: [1594, 0, 1310]}
    - {axis: [1, 0, 0], point: [0, 0, 1310]}",
        screws_tool: "{point: [1884, -20, 1320], orientation: {quaternion: [0, 0.7071, 0, 0.7071]}}",
        dh: "
    - {theta: 0, d: 0, a: 312, alpha: 90}
    - {theta: 90, d: 0, a: 1075, alpha: 0}
    - {theta: 0, d: 0, a: 235, alpha: 90}
    - {theta: 0, d: 1282, a: 0, alpha: -90}
    - {theta: 0, d: 0, a: 0, alpha: 90}
    - {theta: 0, d: 260, a: 0, alpha: 0}",
        mdh: "
    - {alpha: 0, a: 0, theta: 0, d: 0}
    - {alpha: 90, a: 312, theta: 90, d: 0}
    - {alpha: 0, a: 1075, theta: 0, d: 0}
    - {alpha: 90, a: 235, theta: 0, d: 1282}
    - {alpha: -90, a: 0, theta: 0, d: 0}
    - {alpha: 90, a: 0, theta: 0, d: 260}",
        dh_tool: "{point: [10, 20, 30]}",
    },
    Arm {
        name: "seven",
        screws: "
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, 1, 0], point: [0, 0, 340]}
    - {axis: [0, 0, 1], point: [0, 0, 340]}
    - {axis: [0, -1, 0], point: [0, 0, 740]}
    - {axis: [0, 0, 1], point: [0, 0, 740]}
    - {axis: [0, 1, 0], point: [0, 0, 1140]}
    - {axis: [0, 0, 1], point: [0, 0, 1140]}",
        screws_tool: "{point: [70, 30, 1300]}",
        dh: "
    - {theta: 0, d: 340, a: 0, alpha: -90}
    - {theta: 0, d: 0, a: 0, alpha: 90}
    - {theta: 0, d: 400, a: 0, alpha: 90}
    - {theta: 0, d: 0, a: 0, alpha: -90}
    - {theta: 0, d: 400, a: 0, alpha: -90}
    - {theta: 0, d: 0, a: 0, alpha: 90}
    - {theta: 0, d: 126, a: 0, alpha: 0}",
        mdh: "
    - {alpha: 0, a: 0, theta: 0, d: 340}
    - {alpha: -90, a: 0, theta: 0, d: 0}
    - {alpha: 90, a: 0, theta: 0, d: 400}
    - {alpha: 90, a: 0, theta: 0, d: 0}
    - {alpha: -90, a: 0, theta: 0, d: 400}
    - {alpha: -90, a: 0, theta: 0, d: 0}
    - {alpha: 90, a: 0, theta: 0, d: 126}",
        dh_tool: "{point: [70, 30, 34]}",
    },
    Arm {
        name: "track",
        screws: "
    - {kind: prismatic, axis: [1, 0, 0]}
    - {axis: [0, 0, 1], point: [0, 0, 500]}
    - {axis: [0, -1, 0], point: [0, 0, 627.3]}
    - {axis: [0, -1, 0], point: [-612, 0, 627.3]}
    - {axis: [0, -1, 0], point: [-1184.3, 0, 627.3]}
    - {axis: [0, 0, -1], point: [-1184.3, -163.941, 627.3]}
    - {axis: [0, -1, 0], point: [-1184.3, -163.941, 511.6]}",
        screws_tool: "{point: [-1184.3, -256.141, 511.6], orientation: {rpy: [90, 0, 0]}}",
        dh: "
    - {kind: fixed, theta: 90, d: 500, a: 0, alpha: 90}
    - {kind: prismatic, theta: 0, a: 0, alpha: -90}
    - {theta: -90, d: 127.3, a: 0, alpha: 90}
    - {theta: 0, d: 0, a: -612, alpha: 0}
    - {theta: 0, d: 0, a: -572.3, alpha: 0}
    - {theta: 0, d: 163.941, a: 0, alpha: 90}
    - {theta: 0, d: 115.7, a: 0, alpha: -90}
    - {theta: 0, d: 92.2, a: 0, alpha: 0}",
        mdh: "
    - {kind: fixed, alpha: 0, a: 0, theta: 90, d: 500}
    - {kind: prismatic, alpha: 90, a: 0, theta: 0}
    - {alpha: -90, a: 0, theta: -90, d: 127.3}
    - {alpha: 90, a: 0, theta: 0, d: 0}
    - {alpha: 0, a: -612, theta: 0, d: 0}
    - {alpha: 0, a: -572.3, theta: 0, d: 163.941}
    - {alpha: 90, a: 0, theta: 0, d: 115.7}
    - {alpha: -90, a: 0, theta: 0, d: 92.2}",
        dh_tool: "{point: [0, 0, 0]}",
    },
];
