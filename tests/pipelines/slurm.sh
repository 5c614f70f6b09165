#!/usr/bin/env bash
# A real one-node Slurm on loopback (munged, slurmctld, slurmd; no systemd, no cgroups): a sweep of 40 points submitted,
# cancelled midway, submitted again; every point is there once, and right.
# usage: slurm.sh SHAKEBED   (exit 77: Slurm is not installed here)
set -eu
shakebed=$(realpath "$1")
export PATH="$PATH:/usr/sbin:/sbin"
for program in munged slurmctld slurmd sbatch squeue scancel; do
  command -v "$program" >/dev/null || { echo "SKIPPED: $program is not installed (Debian: slurm-wlm, munge)"; exit 77; }
done
folder=$(mktemp -d /tmp/shakebed-slurm.XXXXXX)
chmod 755 "$folder"
daemons=()
stop() {
  for (( i = ${#daemons[@]} - 1; i >= 0; i-- )); do kill "${daemons[i]}" 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf "$folder"
}
trap stop EXIT
fail() {
  echo "FAILED: $*"
  tail -n 25 "$folder"/*.log 2>/dev/null || true
  exit 1
}
wait_until() {  # SECONDS COMMAND...: until the command succeeds
  local end=$(( SECONDS + $1 )); shift
  until "$@" >/dev/null 2>&1; do
    [ "$SECONDS" -lt "$end" ] || return 1
    sleep 0.1
  done
}
free_port() {
  local port
  while :; do
    port=$(( 20000 + RANDOM % 40000 ))
    (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port"; return; }
  done
}

# --- the cluster
user=$(id -un)
node=$(hostname -s)
mkdir -m 700 "$folder/munge" && mkdir "$folder/state" "$folder/spool"
dd if=/dev/urandom of="$folder/munge/key" bs=128 count=1 2>/dev/null
chmod 400 "$folder/munge/key"
munged --foreground --force --key-file="$folder/munge/key" --socket="$folder/munge.socket" \
  --pid-file="$folder/munge/pid" --log-file="$folder/munge/log" --seed-file="$folder/munge/seed" --num-threads=2 \
  >"$folder/munged.log" 2>&1 &
daemons+=($!)
cat >"$folder/slurm.conf" <<CONF
ClusterName=shakebed-test
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
SchedulerParameters=sched_min_interval=100000,batch_sched_delay=0,sched_interval=1
ReturnToService=2
KillWait=5
MpiDefault=none
NodeName=$node NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=test Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
echo "CgroupAutomount=no" >"$folder/cgroup.conf"
export SLURM_CONF="$folder/slurm.conf"
wait_until 20 test -S "$folder/munge.socket" || fail "munged did not start"
slurmctld -D -c -f "$SLURM_CONF" >"$folder/slurmctld.out.log" 2>&1 &
daemons+=($!)
slurmd -D -N "$node" -f "$SLURM_CONF" >"$folder/slurmd.out.log" 2>&1 &
daemons+=($!)
node_is_idle() { sinfo --noheader --format=%T | grep -q '^idle'; }
wait_until 60 node_is_idle || { sinfo || true; fail "the node did not come up"; }
echo "Slurm $(sinfo --version | cut -d' ' -f2) on $node: $(sinfo --noheader --format='%C CPUs (allocated/idle/other/total)')"

# --- the sweep
cd "$folder"
"$shakebed" init bed.json >/dev/null
cat >sweep.json <<'JSON'
{ "name": "forty",
  "stages": [
    { "stage": "simulate", "id": "bed", "seed": 3, "replicas": 1, "units": "reduced",
      "disks": { "count": 40, "restitution": 0.9, "friction": 0.2, "inertia": "sphere" },
      "box": { "width": 10, "sides": { "kind": "hard", "restitution": 0.9 }, "lid": "open" },
      "floor": { "motion": "sinusoidal", "amplitude": 1, "frequency": 0.3, "restitution": 0.9 },
      "settle": 20, "measure": 1500 } ],
  "sweep": { "kind": "grid",
             "over": { "/stages/bed/disks/restitution": { "from": 0.80, "to": 0.95, "count": 10 },
                       "/stages/bed/floor/amplitude": [0.7, 0.8, 0.9, 1.0] },
             "collect": ["/bed/temperature_x", "/bed/temperature_z", "/bed/collisions"] } }
JSON
# How it must come out, without Slurm.
"$shakebed" run sweep.json --out expected --quiet >/dev/null || fail "the sweep does not run without Slurm"
[ "$(wc -l <expected/sweep.csv)" = 41 ] || fail "not 40 points"

finished_points() { find o/points -name .point 2>/dev/null | wc -l; }
field() { grep -o "\"$1\": *\"*[0-9]*" "$2" | grep -o '[0-9]*$'; }
queue_is_empty() { [ -z "$(squeue --noheader)" ]; }

"$shakebed" submit slurm sweep.json --shards 10 --out o --json >first.json || fail "not submitted"
[ "$(field tasks first.json)" = 10 ] || fail "not 10 tasks: $(cat first.json)"
if "$shakebed" submit slurm sweep.json --shards 10 --out o >second.txt 2>&1; then fail "submitted twice at once"; fi
grep -q "still in the queue" second.txt || fail "no reason for refusing: $(cat second.txt)"
some() { [ "$(finished_points)" -ge 8 ]; }
wait_until 120 some || fail "no point was finished"
scancel "$(field job first.json)" "$(field gather_job first.json)"
wait_until 60 queue_is_empty || fail "scancel did not empty the queue"
before=$(finished_points)
echo "cancelled after $before of 40 points"
[ "$before" -lt 40 ] || fail "the cancellation came too late to test anything"
find o/points -name .point -newermt '1970-01-01' -printf '%p %T@\n' | sort >kept.txt
if find o -name '*.part' | grep -q .; then fail "half-written files after scancel"; fi

# Gathering now says what is missing, and runs nothing.
if "$shakebed" run sweep.json --out o --gather >gather.txt 2>&1; then fail "gathered 40 points where there are $before"; fi
[ "$(finished_points)" = "$before" ] || fail "--gather ran points"
grep -q "$before of 40 points done" gather.txt || fail "$(cat gather.txt)"

"$shakebed" submit slurm sweep.json --shards 10 --out o --json >again.json || fail "not submitted again"
[ "$(field to_run again.json)" = $(( 40 - before )) ] || fail "not only the missing ones: $(cat again.json)"
echo "submitted again: $(field to_run again.json) points in $(field tasks again.json) tasks"
wait_until 180 queue_is_empty || fail "the second submission did not end"

# --- every point once, and right
[ "$(finished_points)" = 40 ] || fail "$(finished_points) points"
cmp expected/sweep.csv o/sweep.csv || fail "the results are not those of one machine"
find o/points -name .point -printf '%p %T@\n' | sort >after.txt
[ "$(comm -12 kept.txt after.txt | wc -l)" = "$before" ] || fail "finished points were run again"
for n in $(seq 0 39); do
  point=$(printf 'points/%06d' "$n")
  cmp "expected/$point/bed/profile.csv" "o/$point/bed/profile.csv" || fail "$point differs"
done
if find o \( -name '.partial*' -o -name '*.part' -o -name .scratch \) | grep -q .; then fail "leftovers"; fi
test -s o/report.html || fail "nobody gathered"
# Nothing left to do: only the gathering job is submitted.
"$shakebed" submit slurm sweep.json --shards 10 --out o --json >third.json || fail "a finished sweep cannot be submitted"
[ "$(field to_run third.json)" = 0 ] && [ "$(field tasks third.json)" = 0 ] || fail "runs what is there: $(cat third.json)"
wait_until 60 queue_is_empty || fail "the gathering job did not end"
cmp expected/sweep.csv o/sweep.csv || fail "gathering changed the results"
echo "40 points, each once and as on one machine; $before of them from before the cancellation"
