root=$0
group=$1
groups=$2
mount --make-rprivate /
# A control group of its own, whose root it sees.
mount -t cgroup2 none "$groups"
mkdir -p "$groups/$group"
echo $$ > "$groups/$group/cgroup.procs"
umount "$groups"
ip link set lo up
mount --bind "$root" "$root"
cd "$root"
mount -t proc proc proc
mount --bind proc/sys proc/sys
mount -o remount,bind,ro proc/sys
mount -t sysfs -o ro sys sys
mount -t tmpfs -o mode=755 dev dev
for name in null zero full random urandom tty; do
    touch "dev/$name"
    mount --bind "/dev/$name" "dev/$name"
done
mkdir dev/pts dev/shm
mount -t devpts -o newinstance,ptmxmode=0666,mode=620,gid=5 pts dev/pts
ln -s pts/ptmx dev/ptmx
ln -s /proc/self/fd dev/fd
mount -t tmpfs -o mode=1777 shm dev/shm
mount -t tmpfs -o mode=755 run run
mount -t tmpfs -o mode=1777 tmp tmp
mkdir -p before etc/systemd/system/multi-user.target.wants
cat > etc/systemd/system/booted.service <<'UNIT'
[Unit]
After=ssh.service dbus.service systemd-logind.service
[Service]
Type=oneshot
ExecStart=/usr/bin/touch /booted
UNIT
ln -sf ../booted.service etc/systemd/system/multi-user.target.wants/booted.service
: > etc/machine-id
echo '127.0.0.1 localhost robot' > etc/hosts
hostname robot
exec unshare --cgroup sh -euc '
    mount -t tmpfs groups sys/fs/cgroup 2>/dev/null || true
    mount -t cgroup2 none sys/fs/cgroup
    pivot_root . before
    umount -l /before
    exec env -i container=other PATH=/usr/sbin:/usr/bin:/sbin:/bin /lib/systemd/systemd
'
