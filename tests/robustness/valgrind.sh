#!/bin/sh
# One small run of each command under valgrind's memcheck: bytes used before they were written, read or written beyond
# their end, freed twice, lost for good. A line for each; fails when any run has an error or does not end as expected.
# Children (gnuplot) are not looked into. Skipped (77) without valgrind. Three minutes of CPU.
#   valgrind.sh PROGRAM [COMMAND...]       all commands, or those named
set -eu
program=$1
shift
command -v valgrind >/dev/null || { echo "skipped: there is no valgrind"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
bed='{ "stage": "simulate", "id": "bed", "seed": 7, "replicas": 1, "disks": { "count": 40, "diameter": "3 mm", "restitution": 0.9, "friction": 0.1, "contact_duration": "20 us" },
  "gravity": "9.81 m/s^2", "box": { "width": "30 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
  "floor": { "motion": "sinusoidal", "amplitude": "1.5 mm", "frequency": "20 Hz", "restitution": 0.9 },
  "observe": ["order", "velocities", "displacement", "pressure", "phases"],
  "settle": "0.05 s", "measure": "0.1 s", "frames": { "count": 2, "phases": 4 } }'
cat >bed.json <<END
{ "name": "bed", "stages": [ $bed,
  { "stage": "render", "from": "bed", "scale": "0.3 mm/px" },
  { "stage": "extract", "from": "render", "diameter": "3 mm" },
  { "stage": "fit", "from": "bed", "plateau_density": 1.1 },
  { "stage": "map", "from": ["fit", "bed"] },
  { "stage": "figure", "from": ["bed", "fit"] },
  { "stage": "check", "from": ["bed", "fit"], "expect": { "/bed/column_number": { "value": 4, "relative": 1e-12 } } } ] }
END
cat >sweep.json <<END
{ "name": "sweep", "stages": [ $bed ],
  "sweep": { "over": { "/stages/bed/disks/restitution": [0.7, 0.8] } } }
END
# Beds of 20 disks over two parameters, and the sampling of their posterior.
cat >infer.json <<END
{ "name": "infer", "stages": [ { "stage": "infer", "units": "reduced", "disks": { "count": 20, "restitution": 0.7 },
  "box": { "width": 5.3, "sides": "periodic" }, "floor": { "motion": "sinusoidal", "gamma": 4, "frequency": 0.35, "restitution": 0.7 },
  "settle": 3, "measure": 12, "phases": 4,
  "parameters": { "gamma": { "set": ["/floor/gamma"], "low": 3, "high": 6 },
                  "restitution": { "set": ["/disks/restitution", "/floor/restitution"], "low": 0.5, "high": 0.9 } },
  "targets": { "center_of_mass_rise": { "value": 1, "std_error": 0.3 } },
  "first": 16, "rounds": 0, "best": 1, "best_replicas": 2, "draws": 100 } ] }
END

# valgrind knows the instruction rdtscp only where the processor lists it. libhwy, which OpenCV loads, uses it when it is
# loaded, to time itself. Where the processor does not list it, that function is replaced by one that does not.
preload=
if [ -r /proc/cpuinfo ] && ! grep -qw rdtscp /proc/cpuinfo; then
  echo 'unsigned long _ZN3hwy8platform15TimerResolutionEv(void) { return 1; }' >timer.c
  cc -shared -fPIC timer.c -o timer.so && preload=$folder/timer.so
fi

failed=0
# check NAME EXPECTED_CODES ARGUMENTS...: runs it unless others were asked for.
wanted=" $* "
check() {
  name=$1 expected=$2
  shift 2
  case "$wanted" in "  " | *" $name "*) ;; *) return 0 ;; esac
  code=0
  LD_PRELOAD=$preload valgrind --quiet --error-exitcode=99 --leak-check=full --errors-for-leak-kinds=definite --show-leak-kinds=definite \
    --num-callers=30 --log-file="$name.log" \
    "$program" "$@" >"$name.out" 2>"$name.err" || code=$?
  case " $expected " in
  *" $code "*) printf '%-12s ends with %d, no error\n' "$name" "$code" ;;
  *)
    printf '%-12s ends with %d\n' "$name" "$code"
    tail -n 5 "$name.err"
    head -n 60 "$name.log"
    failed=1
    ;;
  esac
}
check theory 0 theory --json
check map 0 map --gamma 4 --frequency 20 --diameter 3e-3 --initial-height 10
check audit "0 6" audit
check init 0 init mine.json
check schema 0 schema
check validate 0 validate bed.json
check run 0 run bed.json --out results/bed
# The commands below read what `run` left; by itself it need not be watched.
[ -d results/bed ] || "$program" run bed.json --out results/bed --quiet >/dev/null 2>&1
check sweep 0 run sweep.json --out results/sweep
check explain 0 explain bed.json --out results/bed
check graph 0 graph bed.json
check status 0 status results/bed
check verify 0 verify results/bed
check fit-profile 0 fit-profile results/bed/bed/profile.csv --out profile
[ -d results/sweep ] || "$program" run sweep.json --out results/sweep --quiet >/dev/null 2>&1
check rerun "0 6" rerun results/sweep --out again
check fit-images 0 fit-images results/bed/render/frames --diameter "3 mm" --out images
check infer 0 run infer.json --out results/infer
# Settled shortly, at the values about the edge alone: what it finds is not the question.
check reproduce "0 6" reproduce bouncing-ball --preset quick --out figure --set /stages/e0/stages/0/settle=60 \
  --set /stages/e5/stages/0/settle=60 --set /stages/e10/stages/0/settle=60 --set /stages/bed/settle=60 \
  --set '/stages/e0/parameter/values=[3.72,3.73]' --set '/stages/e5/parameter/values=[3.37,3.38]' --set '/stages/e10/parameter/values=[3.06,3.07]'
check submit 0 submit slurm sweep.json --out cluster --dry-run
check bench "0 6" bench fit --quick --out bench
check clean 0 clean results
exit $failed
