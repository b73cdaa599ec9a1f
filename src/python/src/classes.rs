//! Robot, model, outcome of a stage, and run.

use crate::arrays::{array, matrix, poses, sigma};
use crate::frame::Frame;
use crate::raised;
use crate::wait::wait;
use calib::api::{self, Options, RunRequest};
use calib::cli::{cores, open_store, surroundings};
use calib::pipeline::StageTables;
use calib::poses::PoseRequest;
use calib::report::PageLanguage;
use calib::table::Table;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::Arc;

#[pyclass(frozen)]
pub struct Robot(api::Robot);

#[pymethods]
impl Robot {
    #[staticmethod]
    fn from_file(path: PathBuf) -> PyResult<Self> {
        api::Robot::from_file(&path).map(Self).map_err(raised)
    }
    #[staticmethod]
    fn from_text(label: &str, text: &str) -> PyResult<Self> {
        let robot = api::Robot::from_text(label, text);
        robot.map(Self).map_err(raised)
    }
    #[staticmethod]
    fn from_urdf(path: PathBuf, tip: &str) -> PyResult<Self> {
        api::Robot::from_urdf(&path, tip).map(Self).map_err(raised)
    }
    #[staticmethod]
    fn library(name: &str) -> PyResult<Self> {
        api::Robot::library(name).map(Self).map_err(raised)
    }
    #[getter]
    fn name(&self) -> &str {
        &self.0.description.name
    }
    #[getter]
    fn joints(&self) -> Vec<&str> {
        let joints = self.0.description.joints.iter();
        joints.map(|joint| joint.name.as_str()).collect()
    }
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes.clone()
    }

    /// Travel of each joint, NaN where none is stated.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let joints = self.0.description.joints.iter();
        let limits = joints.map(|joint| joint.limits.unwrap_or([f64::NAN; 2]));
        let [lower, upper]: [Vec<f64>; 2] =
            limits.map(|[lower, upper]| (lower, upper)).unzip().into();
        let ends = self
            .0
            .from_si(&lower)
            .into_iter()
            .zip(self.0.from_si(&upper));
        array(
            py,
            &ends
                .flat_map(|(lower, upper)| [lower, upper])
                .collect::<Vec<_>>(),
            2,
        )
    }

    /// Proposed poses: joints, payloads, directions; the answer as JSON and as text. `request` is JSON.
    fn poses<'py>(
        &self,
        py: Python<'py>,
        request: &str,
        pair: Vec<String>,
        limits: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Vec<Bound<'py, PyAny>>, String, String)> {
        let mut request: PoseRequest = serde_json::from_str(request)
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        if let Some(limits) = limits {
            let given = matrix(
                "limits",
                limits,
                2,
                "lower and upper end of each joint, rad",
            )?;
            let ends = given.as_chunks().0.iter().zip(self.0.prismatic());
            let shown = ends.map(|(ends, slides): (&[f64; 2], _)| match slides {
                true => *ends,
                false => ends.map(f64::to_degrees),
            });
            request.limits = Some(shown.collect());
        }
        let robot = self.0.clone();
        let found = wait(py, None, move |_| {
            api::propose_poses(&robot, &request, &pair)
        })?;
        let (poses, joints) = (&found.poses, self.0.joints());
        let arrays = [
            (&poses.joints_rad, joints),
            (&poses.columns["payload_kg"], 1),
            (&poses.columns["dir"], joints),
        ];
        let arrays = arrays.map(|(values, columns)| array(py, values, columns));
        let arrays = arrays.into_iter().collect::<PyResult<_>>()?;
        Ok((arrays, found.document.to_string(), found.text))
    }

    /// Runs a stage: `identify` or `diagnose`.
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn stage(
        &self,
        py: Python<'_>,
        uses: String,
        joints: &Bound<'_, PyAny>,
        points: &Bound<'_, PyAny>,
        noise: Option<&Bound<'_, PyAny>>,
        held_out: Option<Vec<bool>>,
        columns: &Bound<'_, PyDict>,
        settings: &str,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Outcome> {
        let points = matrix("points", points, 3, "x, y, z in mm")?;
        let recording = api::Recording {
            points_mm: points.as_chunks().0.to_vec(),
            sigma: sigma(noise)?,
            held_out,
            ..poses(&self.0, joints, columns)?
        };
        let robot = self.0.clone();
        let with = serde_json::from_str(settings)
            .map_err(|error| PyValueError::new_err(format!("settings: {error}")))?;
        let found = wait(py, progress, move |observer| {
            let options = Options {
                with,
                seed,
                observer,
            };
            if uses == "diagnose" {
                let found = api::diagnose(&robot, &recording, &options)?;
                return Ok((Some(found.summary), found.model, found.given));
            }
            let found = api::identify(&robot, &recording, &options)?;
            Ok((None, found.model, found.given))
        })?;
        let (remarks, model, given) = found;
        Ok(Outcome {
            document: remarks
                .as_ref()
                .map(|remarks| remarks.document("").to_string()),
            text: remarks.as_ref().map(|remarks| remarks.text("")),
            page: remarks
                .and_then(|remarks| remarks.page("", PageLanguage::English).ok())
                .map(|page| page.html),
            model: Py::new(py, Model::new(model))?,
            notes: given.notes.clone(),
            warnings: given.warnings.clone(),
            given,
        })
    }
}

/// What a stage gave.
#[pyclass(frozen)]
pub struct Outcome {
    #[pyo3(get)]
    document: Option<String>,
    #[pyo3(get)]
    text: Option<String>,
    #[pyo3(get)]
    page: Option<String>,
    #[pyo3(get)]
    model: Py<Model>,
    #[pyo3(get)]
    notes: Vec<String>,
    #[pyo3(get)]
    warnings: Vec<String>,
    given: StageTables,
}

#[pymethods]
impl Outcome {
    #[getter]
    fn tables(&self) -> Vec<(&'static str, Frame)> {
        let tables = self.given.tables.iter();
        tables
            .map(|(port, frame)| (*port, Frame(frame.clone())))
            .collect()
    }
}

#[pyclass(frozen)]
pub struct Model(Arc<api::Model>);

impl Model {
    fn new(model: api::Model) -> Self {
        Self(Arc::new(model))
    }
}

#[pymethods]
impl Model {
    #[getter]
    fn parameters(&self) -> PyResult<Frame> {
        let table = self.0.parameters().to_frame();
        table.map(Frame).map_err(raised)
    }
    #[getter]
    fn origin(&self) -> &str {
        &self.0.identified.origin
    }
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.identified.warnings.clone()
    }

    fn predict<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'_, PyAny>,
        columns: &Bound<'_, PyDict>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let poses = poses(&self.0.robot(), joints, columns)?.poses;
        let model = self.0.clone();
        let points = wait(py, None, move |_| model.predict(&poses))?;
        array(py, points.as_flattened(), 3)
    }

    /// Joints, three columns of numbers, and remarks.
    fn compensate<'py>(
        &self,
        py: Python<'py>,
        joints: &Bound<'_, PyAny>,
        columns: &Bound<'_, PyDict>,
        force: bool,
    ) -> PyResult<(Vec<Bound<'py, PyAny>>, Vec<String>)> {
        let poses = poses(&self.0.robot(), joints, columns)?.poses;
        let model = self.0.clone();
        let found = wait(py, None, move |_| model.compensate(&poses, force))?;
        let arrays = [
            (&found.joints_rad, self.0.robot().joints()),
            (&found.uncorrected_mm, 1),
            (&found.residual_mm, 1),
            (&found.u95_mm, 1),
        ];
        let arrays = arrays.map(|(values, columns)| array(py, values, columns));
        Ok((arrays.into_iter().collect::<PyResult<_>>()?, found.remarks))
    }
}

#[pyclass(frozen)]
pub struct Run(api::CalibRun);

#[pyfunction]
pub fn run(
    py: Python<'_>,
    pipeline: PathBuf,
    overrides: Vec<String>,
    store: Option<PathBuf>,
    jobs: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Run> {
    let done = wait(py, progress, move |observer| {
        let request = RunRequest {
            pipeline: &pipeline,
            overrides: &overrides,
            jobs: jobs.unwrap_or_else(cores).max(1),
            surroundings: &surroundings(&["calib.run".into(), pipeline.clone().into()]),
            observer,
        };
        api::run(&request, open_store(store.as_deref())?)
    });
    done.map(Run)
}

#[pyfunction]
pub fn open_run(name: &str, store: Option<PathBuf>) -> PyResult<Run> {
    let store = open_store(store.as_deref()).map_err(raised)?;
    api::CalibRun::open(store, name).map(Run).map_err(raised)
}

#[pymethods]
impl Run {
    #[getter]
    fn manifest(&self) -> String {
        serde_json::to_string(&self.0.manifest).unwrap_or_default()
    }
    #[getter]
    fn tables(&self) -> Vec<String> {
        self.0.tables()
    }
    fn table(&self, name: &str) -> PyResult<Frame> {
        self.0.table(name).map(Frame).map_err(raised)
    }
    fn model(&self, step: Option<&str>) -> PyResult<Model> {
        self.0.model(step).map(Model::new).map_err(raised)
    }

    /// The stage that diagnosed, the diagnosis as JSON and as text, and its page.
    fn diagnosis(&self, step: Option<&str>) -> PyResult<(String, String, String, Option<String>)> {
        let (stage, summary) = self.0.diagnosis(step).map_err(raised)?;
        Ok((
            stage,
            summary.document("").to_string(),
            summary.text(""),
            self.0
                .diagnosis_page(step, PageLanguage::English)
                .ok()
                .map(|page| page.html),
        ))
    }
}
