d=$(ls -d /tmp/.tmp*/agents | head -1); d=${d%/agents}
net=$(ls $d/state/robocomp | head -1)
export XDG_RUNTIME_DIR=$d/run XDG_STATE_HOME=$d/state
ns=$(ip netns list | grep "a0" | awk '{print $1}' | head -1)
R="ip netns exec $ns /work/main/target/debug/rcdeploy"
timeout 20 $R list $net 2>&1 | cut -c1-150 | head -60
for t in agent17/told/chunk agent18/told/chunk agent18/told/digest agent18/told/ask agent6/told/chunk; do echo == $t; timeout 6 $R hz $net $net/$t 2>&1 | head -4; done
tail -n 3 $d/state/robocomp/$net/agent18.log $d/state/robocomp/$net/agent19.log
