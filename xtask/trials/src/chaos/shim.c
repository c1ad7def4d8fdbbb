/* Loaded before the C library into rcdeploy and its components (`LD_PRELOAD`): moves the clock of
   the system and slows the disk, for these processes alone. The file that `RC_CHAOS_SHIM` names
   holds two numbers of eight bytes in the order of the machine: the seconds by which the clock is
   wrong, and the microseconds that a write to a file takes longer. They change while the processes
   run. Times of files stay those of the kernel, as on a disk of another machine. So do waits until
   a time of the system's clock (`pthread_cond_timedwait`, `sem_timedwait`, timers): after a jump
   they last too long or not at all. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

static const int64_t right[2];
static const volatile int64_t *numbers = right;

__attribute__((constructor)) static void map_numbers(void) {
    const char *path = getenv("RC_CHAOS_SHIM");
    int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0)
        return;
    void *mapped = mmap(NULL, sizeof right, PROT_READ, MAP_SHARED, file, 0);
    close(file);
    if (mapped != MAP_FAILED)
        numbers = mapped;
}

/* The function of the C library, which needs no call of the kernel, so that times are measured as
   without this library. */
static int read_clock(clockid_t clock, struct timespec *time) {
    static int (*volatile known)(clockid_t, struct timespec *);
    int (*next)(clockid_t, struct timespec *) = known;
    if (!next)
        known = next = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    return next ? next(clock, time) : (int)syscall(SYS_clock_gettime, clock, time);
}

int clock_gettime(clockid_t clock, struct timespec *time) {
    int result = read_clock(clock, time);
    if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        time->tv_sec += numbers[0];
    return result;
}

int gettimeofday(struct timeval *restrict time, void *restrict zone) {
    struct timespec now;
    (void)zone;
    if (clock_gettime(CLOCK_REALTIME, &now) != 0)
        return -1;
    time->tv_sec = now.tv_sec;
    time->tv_usec = now.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *result) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (result)
        *result = now.tv_sec;
    return now.tv_sec;
}

/* Waits if the descriptor is that of a file; pipes and sockets are as quick as ever. */
static void wait_for_disk(int descriptor) {
    int64_t more = numbers[1];
    int before = errno;
    struct stat file;
    if (more > 0 && fstat(descriptor, &file) == 0 && S_ISREG(file.st_mode)) {
        struct timespec pause = {more / 1000000, more % 1000000 * 1000};
        nanosleep(&pause, NULL);
    }
    errno = before;
}

ssize_t write(int descriptor, const void *data, size_t size) {
    wait_for_disk(descriptor);
    return syscall(SYS_write, descriptor, data, size);
}

ssize_t writev(int descriptor, const struct iovec *parts, int count) {
    wait_for_disk(descriptor);
    return syscall(SYS_writev, descriptor, parts, count);
}

ssize_t pwrite64(int descriptor, const void *data, size_t size, off64_t at) {
    wait_for_disk(descriptor);
    return syscall(SYS_pwrite64, descriptor, data, size, at);
}

int fsync(int descriptor) {
    wait_for_disk(descriptor);
    return (int)syscall(SYS_fsync, descriptor);
}

int fdatasync(int descriptor) {
    wait_for_disk(descriptor);
    return (int)syscall(SYS_fdatasync, descriptor);
}
