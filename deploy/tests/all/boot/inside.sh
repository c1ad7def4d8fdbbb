stage=$1
step() { echo "== $*"; }
fail() { echo "FAILED: $*" >&2; journalctl --no-pager -n 60 >&2; exit 1; }
ssh_pi() { ssh -o LogLevel=ERROR -o StrictHostKeyChecking=no pi@localhost "$@"; }
# Waits until a command succeeds.
until_so() { for _ in $(seq 600); do if "$@" > /dev/null 2>&1; then return 0; fi; sleep 0.1; done; fail "never: $*"; }
runs() { ssh_pi rcdeploy status patrol --format json | grep '"avoider"'; }
# Whether a program that starts now receives something.
reaches() { ssh_pi timeout 20 rcdeploy echo patrol newFullPose --once > /dev/null; }
# The logins of pi have ended, and systemd has done what it does then.
logged_out() { [ "$(loginctl show-user pi --property Sessions --value 2>/dev/null)" = "" ]; }
closing() { [ "$(loginctl show-user pi --property State --value 2>/dev/null)" = closing ]; }
logins() { mkdir -p /etc/systemd/logind.conf.d; printf '[Login]\nKillUserProcesses=%s\nUserStopDelaySec=0\n' "$1" > /etc/systemd/logind.conf.d/test.conf; systemctl restart systemd-logind; }
file=/home/pi/robot/patrol.ddsl
unit=robocomp-patrol.service

if [ "$stage" = again ]; then
    step "it runs after the boot, and nobody has logged in"
    until_so su pi -c 'rcdeploy status patrol'
    until_so reaches
    ssh_pi rcdeploy install-service "$file" --remove
    [ ! -e /home/pi/.config/systemd/user/$unit ] || fail "the unit is there"
    until_so sh -c '! pgrep -u pi rcdeploy'
    exit 0
fi

useradd --create-home --shell /bin/bash pi
[ "$(id -u pi)" -ge 1000 ]
mkdir -p /root/.ssh
ssh-keygen -q -t ed25519 -N '' -f /root/.ssh/id_ed25519
install -d -o pi -g pi -m 700 /home/pi/.ssh
install -o pi -g pi -m 600 /root/.ssh/id_ed25519.pub /home/pi/.ssh/authorized_keys
install -d -o pi -g pi /home/pi/robot
install -o pi -g pi /root/patrol.ddsl $file
until_so ssh_pi true

step "a network over ssh goes on, because its processes keep the login open"
logins no
said=$(ssh_pi 'cd robot && rcdeploy up --detach patrol.ddsl' 2>&1) || fail "$said"
case $said in *linger*) fail "$said";; esac
until_so closing
reaches || fail "it does not go on"
ssh_pi rcdeploy down patrol
until_so logged_out

step "where systemd ends the processes of a login, up says so"
logins yes
said=$(ssh_pi 'cd robot && rcdeploy up --detach patrol.ddsl' 2>&1) || fail "$said"
case $said in *'loginctl enable-linger pi'*) ;; *) fail "$said";; esac
until_so logged_out
until_so sh -c '! pgrep -u pi rcdeploy'
if ssh_pi rcdeploy status patrol; then fail "it goes on"; fi

step "a user who lingers has it outside of the login"
loginctl enable-linger pi
said=$(ssh_pi 'cd robot && rcdeploy up --detach patrol.ddsl' 2>&1) || fail "$said"
case $said in *linger*) fail "$said";; esac
until_so logged_out
reaches || fail "it does not go on"
ssh_pi rcdeploy down patrol
logins no
loginctl disable-linger pi

step "a service of the system: its owner lingers, and everybody finds it"
cd /home/pi/robot
rcdeploy install-service --system patrol.ddsl
[ -e /var/lib/systemd/linger/pi ] || fail "pi does not linger"
until_so runs
su pi -c 'env -i PATH=/usr/bin rcdeploy status patrol' > /dev/null || fail "by su"
systemd-run --quiet --wait --uid=pi rcdeploy status patrol || fail "in a unit"
if said=$(rcdeploy status patrol 2>&1); then fail "root has none"; fi
case $said in *'user root (0) has none in /dev/shm/robocomp-0'*'; user pi ('*') has patrol'*) ;; *) fail "$said";; esac

step "a logout removes its memory: all restart in order"
loginctl disable-linger pi
systemctl stop user@1000.service
until_so sh -c 'journalctl --unit '$unit' | grep -q "shared memory of the network was removed"'
until_so sh -c 'journalctl --unit '$unit' | grep -q "all components have restarted with new shared memory"'
loginctl enable-linger pi
until_so reaches
rcdeploy install-service --system patrol.ddsl --remove
until_so sh -c '! pgrep -u pi rcdeploy'

step "a service of the user: the end of the supervisor, and the log"
ssh_pi rcdeploy install-service $file
until_so runs
supervisor() { ssh_pi systemctl --user show --property MainPID --value $unit; }
first=$(supervisor)
another() { now=$(supervisor); [ "${now:-0}" != 0 ] && [ "$now" != "$first" ]; }
if another; then fail "$first is the supervisor"; fi
kill -KILL "$first"
until_so another
until_so reaches
ssh_pi journalctl --user --unit $unit | grep 'network patrol is up' > /dev/null || fail "no log"
