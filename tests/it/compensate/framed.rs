//! Programs with several frames and tools: every target stands in the frame, and is reached with the tool, that is in force where it is moved
//! to. The true robot goes to the same points as with the targets stated as joints.

use super::cell;
use super::maker::{Maker, PLAIN, makers_of};
use super::round_trip::{Trip, pose, read};
use super::sides::{confdata, krl, poses, rapid, status, turn};
use crate::answer::{calib, has};
use crate::fixture::apart;
use calib::compensate::turns;
use calib::program::{Companion, Language, Rewritten, RobotTool};
use calib::spatial::Pose;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// mm and deg, as KUKA states frames.
type Numbers = [f64; 6];

const BASES: [Numbers; 3] = [
    [0.0; 6],
    [812.5, -240.0, 310.25, 35.0, -4.0, 2.5],
    [-150.0, 600.0, 120.0, 90.0, 0.0, 180.0],
];
const GUN: Numbers = [12.0, -64.5, 181.25, 30.0, 20.0, -10.0];

fn frame([x, y, z, a, b, c]: Numbers) -> Pose {
    Pose::new(
        turns(a.to_radians(), b.to_radians(), c.to_radians()),
        Vector3::new(x, y, z) * 1e-3,
    )
}

/// The flange of the arm at its zero pose: 80 mm from the wrist centre, z along axis 6.
fn flange() -> Pose {
    Pose::new(
        Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0),
        Vector3::new(0.78, 0.0, 0.9),
    )
}

/// The robot file's tool at the flange: 50, 40 and 30 mm off it in the base's axes, and turned as the base.
fn own_tool(trip: &Trip) -> Pose {
    flange().inverse() * *trip.robot.home()
}

fn numbers(pose: &Pose) -> Numbers {
    let (c, b, a) = UnitQuaternion::from_matrix(&pose.rotation).euler_angles();
    let [x, y, z]: [f64; 3] = (pose.translation * 1e3).into();
    [x, y, z, a.to_degrees(), b.to_degrees(), c.to_degrees()]
}

fn aggregate([x, y, z, a, b, c]: Numbers) -> String {
    format!("{{X {x:.7},Y {y:.7},Z {z:.7},A {a:.9},B {b:.9},C {c:.9}}}")
}

fn list(pose: &Pose) -> String {
    let turn = UnitQuaternion::from_matrix(&pose.rotation);
    let [x, y, z]: [f64; 3] = (pose.translation * 1e3).into();
    format!(
        "[[{x:.7},{y:.7},{z:.7}],[{:.12},{:.12},{:.12},{:.12}]]",
        turn.w, turn.i, turn.j, turn.k
    )
}

/// A target: its joints, the number of its base, and whether the gun goes there.
struct Target {
    q: Vec<f64>,
    base: usize,
    gun: bool,
}

impl Target {
    /// From the pose of the robot file's tool to the numbers of the program, and back.
    fn tool(&self, trip: &Trip) -> Pose {
        if self.gun {
            own_tool(trip).inverse() * frame(GUN)
        } else {
            Pose::identity()
        }
    }

    fn stated(&self, trip: &Trip) -> Pose {
        frame(BASES[self.base]).inverse() * trip.robot.forward(&self.q) * self.tool(trip)
    }

    fn meant(&self, trip: &Trip, stated: Pose) -> Pose {
        frame(BASES[self.base]) * stated * self.tool(trip).inverse()
    }
}

fn targets(trip: &Trip, maker: &Maker) -> Vec<Target> {
    let of_k = |(k, q): (usize, Vec<f64>)| Target {
        q,
        base: k % 3,
        gun: k % 5 < 2,
    };
    poses(trip, maker, 24)
        .into_iter()
        .enumerate()
        .map(of_k)
        .collect()
}

/// The system's data: frames and tools by their numbers.
fn configuration(trip: &Trip) -> String {
    let bases: String = BASES
        .iter()
        .enumerate()
        .map(|(k, base)| format!("BASE_DATA[{}]={}\n", k + 1, aggregate(*base)))
        .collect();
    let tools = [numbers(&own_tool(trip)), GUN].into_iter().enumerate();
    let tools: String = tools
        .map(|(k, tool)| format!("TOOL_DATA[{}]={}\n", k + 1, aggregate(tool)))
        .collect();
    format!(
        "DEFDAT $CONFIG PUBLIC\n{bases}{tools}LOAD_DATA[1]={{M 0.0}}\nLOAD_DATA[2]={{M 0.0}}\nENDDAT\n"
    )
}

fn posture(maker: &Maker, q: &[f64]) -> String {
    format!(",S {},T {}", status(maker, q), turn(maker, q))
}

/// A program under its name, the file of it that is corrected and the others.
type Written = (&'static str, Language, String, Vec<(&'static str, String)>);

fn programs(trip: &Trip, maker: &Maker, targets: &[Target]) -> Vec<Written> {
    let config = || ("$config.dat", configuration(trip));
    let number = |target: &Target| (if target.gun { 2 } else { 1 }, target.base + 1);
    let point = |target: &Target| krl(&target.stated(trip), &posture(maker, &target.q));
    let set: String = targets
        .iter()
        .map(|target| {
            let (tool, base) = number(target);
            format!(
                "$TOOL=TOOL_DATA[{tool}]\nIF $IN[1] THEN\n$BASE=BASE_DATA[{base}]\nELSE\nBAS(#BASE,{base})\nENDIF\n{}",
                point(target)
            )
        })
        .collect();
    let data: String = targets
        .iter()
        .enumerate()
        .map(|(k, target)| {
            let (tool, base) = number(target);
            let data = format!(
                "DECL FDAT FP{k}={{TOOL_NO {tool},BASE_NO {base},IPO_FRAME #BASE,POINT2[] \" \"}}\n"
            );
            point(target).replace("PTP ", &format!("DECL E6POS XP{k}=")) + &data
        })
        .collect();
    let data = format!("DEFDAT WELD\n{data}ENDDAT\n");
    let inline: String = (0..targets.len())
        .map(|k| format!("PDAT_ACT=PPDAT1\nFDAT_ACT=FP{k}\nBAS(#PTP_PARAMS,100)\nPTP XP{k}\n"))
        .collect();
    let with: String = (0..targets.len())
        .map(|k| format!("SPTP XP{k} WITH $VEL_AXIS[1]=SVEL_JOINT(100.0), $TOOL=STOOL2(FP{k}), $BASE=SBASE(FP{k}.BASE_NO), $IPO_MODE=SIPO_MODE(FP{k}.IPO_FRAME), $LOAD=SLOAD(FP{k}.TOOL_NO)\n"))
        .collect();
    let source = |lines: String| format!("DEF WELD()\nBAS(#INITMOV,0)\n{lines}END\n");
    let tools = format!(
        "PERS tooldata own:=[TRUE,{},[1,[0,0,1],[1,0,0,0],0,0,0]];\nPERS tooldata gun:=[TRUE,{},[1,[0,0,1],[1,0,0,0],0,0,0]];\n",
        list(&own_tool(trip)),
        list(&frame(GUN))
    );
    // The second frame as a user frame with an object frame in it.
    let objects: String = BASES
        .iter()
        .enumerate()
        .map(|(k, base)| {
            let user = frame([5.0, -7.0, 9.0, 10.0, 0.0, 0.0]);
            let ours = user.inverse() * frame(*base);
            format!(
                "PERS wobjdata bench{k}:=[FALSE,TRUE,\"\",{},{}];\n",
                list(&user),
                list(&ours)
            )
        })
        .collect();
    let moves: String = targets
        .iter()
        .map(|target| {
            let names = format!(
                "{}\\WObj:=bench{};",
                if target.gun { "gun" } else { "own" },
                target.base
            );
            rapid(&target.stated(trip), confdata(maker, &target.q)).replace("t;", &names)
        })
        .collect();
    let module =
        |declared: &str| format!("MODULE m\n{declared}PROC main()\n{moves}ENDPROC\nENDMODULE\n");
    let system = format!("MODULE system\n{tools}{objects}ENDMODULE\n");
    vec![
        (
            "KRL, lines that set frames",
            Language::Krl,
            source(set),
            vec![config()],
        ),
        (
            "KRL, inline forms",
            Language::Krl,
            data.clone(),
            vec![("weld.src", source(inline)), config()],
        ),
        (
            "KRL, inline forms of splines",
            Language::Krl,
            data,
            vec![("weld.src", source(with)), config()],
        ),
        (
            "RAPID",
            Language::Rapid,
            module(&format!("{tools}{objects}")),
            vec![],
        ),
        (
            "RAPID, two modules",
            Language::Rapid,
            module(""),
            vec![("system.mod", system)],
        ),
    ]
}

#[test]
fn every_target_stands_in_its_frame_and_is_reached_with_its_tool() {
    let trip = Trip::new();
    for maker in makers_of(&[PLAIN.name, "KUKA", "signs 1, 4, 6", "zeros"]) {
        let targets = targets(&trip, &maker);
        let wanted: Vec<Vec<f64>> = targets.iter().map(|target| target.q.clone()).collect();
        let ours = trip.misses_by_joints(&maker, &wanted);
        for (name, language, text, others) in programs(&trip, &maker, &targets) {
            let companions: Vec<Companion> = others
                .iter()
                .map(|(place, text)| Companion {
                    place,
                    text: text.as_bytes(),
                })
                .collect();
            let tool = if language == Language::Krl {
                "1"
            } else {
                "own"
            };
            let tool = Some(RobotTool::parse(tool).unwrap());
            let written = trip.compensated_by(&maker, language, &text, &companions, tool);
            let written =
                written.unwrap_or_else(|refused| panic!("{} {name}: {refused}", maker.name));
            let literals = read(language, &written.bytes);
            assert_eq!(literals.len(), targets.len(), "{name}");
            let driven = literals
                .iter()
                .zip(&targets)
                .map(|(one, target)| trip.driven(target.meant(&trip, pose(one)), &target.q));
            let misses = trip.misses(&wanted, &driven.collect::<Vec<_>>());
            let apart = apart(&misses, &ours);
            println!(
                "{}: {name}: {apart:.6} mm from the same targets as joints",
                maker.name
            );
            assert!(apart < 1e-3, "{} {name}: {apart} mm", maker.name);
        }
    }
}

#[test]
fn files_beside_a_program_are_read_with_it_in_capitals_too() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::create_dir_all(here.join("R1/Program"))
        .and_then(|()| std::fs::create_dir_all(here.join("R1/System")))
        .unwrap();
    let at = |name: &str| here.join("R1").join(name);
    let write = |name: &str, text: &str| std::fs::write(at(name), text).unwrap();
    let frames =
        "BASE_DATA[3]={X 300,Y 40,Z 500,A 0,B 0,C 0}\nTOOL_DATA[2]={X 40,Y 30,Z 130,A 0,B 0,C 0}\n";
    write("System/$CONFIG.DAT", frames);
    write(
        "Program/WELD.SRC",
        "DEF WELD()\nFDAT_ACT=FP1\nBAS(#PTP_PARAMS,100)\nPTP XP1\nEND\n",
    );
    write(
        "Program/Weld.dat",
        "DEFDAT WELD\nDECL E6POS XP1={X 600,Y 0,Z 430,A 0,B 0,C 0}\nDECL FDAT FP1={TOOL_NO 2,BASE_NO 3,IPO_FRAME #BASE}\nENDDAT\n",
    );
    let program = at("Program/Weld.dat").display().to_string();
    let run = |more: &str| calib(cell(), &format!("compensate latest {program} {more}"));
    let err = run("").code(0).err;
    has(&err, ["read with the program: ", "WELD.SRC", "$CONFIG.DAT"]);
    has(
        &err,
        ["BASE_DATA[3] by FP1 at", "is applied, in the robot's base"],
    );
    has(&err, "the tool TOOL_DATA[2] is taken as the robot file's");
    std::fs::remove_file(at("System/$CONFIG.DAT")).unwrap();
    let undeclared = "BASE_DATA[3], which no file that was read declares";
    has(&run("").refused(), ["Weld.dat:2:", undeclared]);
    write("frames.dat", frames);
    run(&format!("--with {}", at("frames.dat").display())).code(0);
    let refused = run("--tool 1,2").code(2);
    has(&refused.err, "--tool: expected the name of a tool");
}

#[test]
fn tools_are_related_where_the_program_says_how_and_refused_where_it_does_not() {
    let trip = Trip::new();
    let text = |tools: &[&str]| -> String {
        let at = trip.robot.forward(&[0.2, 0.1, -0.3, 0.4, 0.5, 0.6]);
        let moves = tools.iter().map(|tool| format!("{tool}\n{}", krl(&at, "")));
        format!(
            "DEF A()\n$BASE=$NULLFRAME\n{}END\n",
            moves.collect::<String>()
        )
    };
    let config = configuration(&trip);
    let config = [Companion {
        place: "$config.dat",
        text: config.as_bytes(),
    }];
    let run = |text: &str, tool: Option<&str>| {
        let tool = tool.map(|tool| RobotTool::parse(tool).unwrap());
        trip.compensated_by(&PLAIN, Language::Krl, text, &config, tool)
    };
    let warns = |written: &Rewritten, part: &str| {
        let notes = &written.warnings;
        let found = notes.iter().find(|note| note.message.contains(part));
        found.unwrap_or_else(|| panic!("{part}: {notes:?}")).line
    };
    let refused = |text: &str, tool: Option<&str>| run(text, tool).expect_err("refused");
    let one = run(&text(&["BAS(#TOOL,1)"]), None).unwrap();
    warns(&one, "TOOL_DATA[1] is taken as the robot file's");
    let off = "the tool stands 65.6 mm from axis 6, the robot file's 50.0 mm";
    has(&refused(&text(&["BAS(#TOOL,2)"]), None), off);
    let two = text(&["BAS(#TOOL,1)", "BAS(#TOOL,2)"]);
    let which = "--tool says which of them is the robot file's";
    has(&refused(&two, None), ["program:6:", which]);
    let by_number = run(&two, Some("1")).unwrap();
    assert_eq!(warns(&by_number, "its tool stands 172.9 mm"), 6);
    let joints = two.replace(
        "END\n",
        "BAS(#TOOL,2)\nPTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\nEND\n",
    );
    let joints = run(&joints, Some("1")).unwrap();
    warns(
        &joints,
        "joints with the tool TOOL_DATA[2]: they are corrected",
    );
    let by_frame = numbers(&own_tool(&trip))
        .map(|number| format!("{number:.9}"))
        .join(",");
    assert_eq!(run(&two, Some(&by_frame)).unwrap().bytes, by_number.bytes);
    let declared = "declared: TOOL_DATA[1], TOOL_DATA[2]";
    has(&refused(&two, Some("7")), ["TOOL_DATA[7]", declared]);
    let frameless = "TOOL_DATA[9], whose frame no file that was read declares";
    has(
        &refused(&text(&["BAS(#TOOL,1)", "BAS(#TOOL,9)"]), Some("1")),
        frameless,
    );
    warns(
        &run(&text(&[""]), None).unwrap(),
        "no tool is set before this target",
    );
    for faulty in ["", "1,2,3", "a b", "1,2,3,4,5,x"] {
        assert!(
            RobotTool::parse(faulty).is_err_and(|printed| printed.contains("X,Y,Z,A,B,C")),
            "{faulty}"
        );
    }
}
