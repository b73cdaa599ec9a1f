#!/bin/bash
# A fleet on a real Slurm of two nodes on this machine, one of which dies in the middle.
#   apt-get install -y --no-install-recommends slurm-wlm slurmctld slurmd munge
#   tests/reference/slurm_fleet.sh target/debug/calib [ROBOTS]
# Needs root (or SlurmUser = SlurmdUser = you). Ends with 0 if every robot ended exactly once and the tables are those of the
# local engine, byte by byte. Takes some four minutes, two of which Slurm holds back the tasks of the dead node.
set -u
CALIB=$(realpath "$1"); ROBOTS=${2:-200}
D=$(mktemp -d /tmp/calib-slurm.XXXXXX); ME=$(id -un); HOST=$(hostname -s)
REPO=$(realpath "$(dirname "$0")/../..")
PIDS=()
finish() {
  for node in n1 n2; do [ -f "$D/slurmd.$node.pid" ] && kill "$(cat "$D/slurmd.$node.pid")" 2>/dev/null; done
  [ -f "$D/slurmctld.pid" ] && kill "$(cat "$D/slurmctld.pid")" 2>/dev/null
  [ -f "$D/munged.pid" ] && kill "$(cat "$D/munged.pid")" 2>/dev/null
  sleep 2; [ -n "${KEEP:-}" ] || rm -rf "$D"
}
trap finish EXIT
fail() { echo "FAILED: $*"; for f in "$D"/*.log; do echo "== $f"; tail -5 "$f"; done; exit 1; }

# The recordings, two of them broken, one with a name that a shell would run.
"$CALIB" simulate conceal --out "$D/cases" --cases "$ROBOTS" --points 60 --seed 11 --nulls 0.9 > /dev/null || fail "no recordings"
R=$D/cases/recordings
rm "$R/c0005/tracker.csv"; echo 'point_id,x_mm' > "$R/c0009/tracker.csv"
mv "$R/c0013" "$R/\$(touch pwned) \"it's\""
cd "$D"
cat > "$D/FLEET.yaml" <<YAML
calib: 1
name: slurm
pipeline: $REPO/pipelines/fleet/pipeline.yaml
robots:
  - folders: cases/recordings/*
YAML
echo "local engine:"
"$CALIB" fleet run "$D/FLEET.yaml" --store "$D/local" --quiet 2> /dev/null | tail -1

# Slurm: one controller, two nodes by name and port, a key of its own.
mkdir -p "$D/run" "$D/state" "$D/spool.n1" "$D/spool.n2"; chmod 711 "$D"; chmod 755 "$D/run"
dd if=/dev/urandom of="$D/munge.key" bs=1024 count=1 2> /dev/null; chmod 400 "$D/munge.key"
munged --force --key-file="$D/munge.key" --socket="$D/run/munge.sock" --pid-file="$D/munged.pid" --log-file="$D/munged.log" \
  --seed-file="$D/munge.seed" || fail "munged"
cat > "$D/slurm.conf" <<CONF
ClusterName=calib
SlurmctldHost=$HOST(127.0.0.1)
SlurmctldPort=16817
SlurmUser=$ME
SlurmdUser=$ME
AuthType=auth/munge
AuthInfo=socket=$D/run/munge.sock
StateSaveLocation=$D/state
SlurmdSpoolDir=$D/spool.%n
SlurmdPidFile=$D/slurmd.%n.pid
SlurmctldPidFile=$D/slurmctld.pid
SlurmdLogFile=$D/slurmd.%n.log
SlurmctldLogFile=$D/slurmctld.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobRequeue=1
ReturnToService=2
SlurmdTimeout=20
SchedulerParameters=batch_sched_delay=0,sched_interval=2
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
NodeName=n[1-2] NodeHostname=$HOST NodeAddr=127.0.0.1 Port=[16821-16822] CPUs=1 State=UNKNOWN
PartitionName=main Nodes=n[1-2] Default=YES State=UP
CONF
export SLURM_CONF=$D/slurm.conf
slurmctld || fail slurmctld
slurmd -N n1 || fail "slurmd n1"; slurmd -N n2 || fail "slurmd n2"
for _ in $(seq 30); do [ "$(sinfo --noheader --states=idle --format=%D 2> /dev/null)" = 2 ] && break; sleep 1; done
sinfo

STORE=$D/shared
records() { find "$STORE/fleets/slurm/records" -name '*.json' 2> /dev/null | wc -l; }
"$CALIB" fleet run "$D/FLEET.yaml" --store "$STORE" --engine slurm --partition main --robots-per-task 5 --json \
  > "$D/result.json" 2> "$D/progress.log" &
RUN=$!
while [ "$(records)" -lt $((ROBOTS / 4)) ] && kill -0 $RUN 2> /dev/null; do sleep 0.3; done
kill -0 $RUN 2> /dev/null || fail "the run ended early: $(tail -3 "$D/progress.log")"
AT=$(records)
# The death of a node: its daemon, what watches its tasks, and the tasks.
kill -9 "$(cat "$D/slurmd.n2.pid")"
LOST=0
for environ in /proc/[0-9]*/environ; do
  if { tr '\0' '\n' < "$environ"; } 2> /dev/null | grep -F "$D" > /dev/null && { tr '\0' '\n' < "$environ"; } 2> /dev/null | grep -qx "SLURMD_NODENAME=n2"; then
    pid=$(basename "$(dirname "$environ")"); parent=$(ps -o ppid= -p "$pid" | tr -d ' ')
    [ "$(ps -o comm= -p "$parent" 2> /dev/null)" = slurmstepd ] && kill -9 "$parent"
    kill -9 "$pid" && LOST=$((LOST + 1))
  fi
done
echo "node n2 killed with $AT of $ROBOTS robots recorded; $LOST of its processes died"
wait $RUN; CODE=$?
sinfo; cat "$D/progress.log" | grep -v '^[0-9]*/' | tail -6
echo "run ended with code $CODE (10: the two broken robots), $(records) records"
[ "$CODE" = 10 ] || fail "code $CODE"

python3 - "$STORE" "$ROBOTS" <<'PY' || fail "not every robot ended exactly once"
import collections, glob, json, sys
store, robots = sys.argv[1], int(sys.argv[2])
records = [json.load(open(path)) for path in glob.glob(store + "/fleets/slurm/records/*/*.json")]
names = collections.Counter(record["robot"] for record in records)
ended = collections.Counter()
killed = 0
for path in glob.glob(store + "/runs/*/manifest.json"):
    manifest = json.load(open(path))
    if manifest["status"] == "running":
        killed += 1
    else:
        ended[manifest["pipeline"]["name"]] += 1
print(f"{len(names)} robots, {len(records)} records, {sum(ended.values())} ended runs, {killed} killed on the way,",
      f"{sum(n > 1 for n in ended.values())} double; workers:", dict(collections.Counter(r["worker"] for r in records)))
assert len(names) == len(records) == robots and all(n == 1 for n in ended.values())
PY
for table in fleet fleet_changes; do
  cmp "$D/local/tables/slurm/fleet.$table.parquet" "$STORE/tables/slurm/fleet.$table.parquet" || fail "table $table differs"
done
[ ! -e "$D/pwned" ] || fail "a name was run as a command"
echo "SUCCESS: tables identical to the local engine's"
