/* SPDX-License-Identifier: MIT */
/* Runs two programs at the ends of a link that has a rate, a delay and a buffer:
 *
 *   shaped_link KBIT_PER_S DELAY_MS BUFFER_KIB NEAR_COMMAND .. -- FAR_COMMAND ..
 *
 * Each end is a network namespace of its own with one interface, 10.77.0.1 near and 10.77.0.2 far, whose packets
 * go through this process: so the system's own TCP sees the link, without any queueing discipline of the kernel's.
 * Both ways alike: a packet waits in the buffer for its turn, is lost if there is no room, takes its size divided
 * by the rate, and comes DELAY_MS later.
 *
 * The far program starts once the near one has printed a line that begins with READY; when it ends, the near one
 * is terminated. Exit status: the far one's; 125: there can be no such link here, said on standard error. Without
 * the rights for namespaces and TUN devices it tries to get them in a user namespace of its own. */
#include "protocol/common/clock.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define EXIT_NO_LINK 125
#define PACKET_BYTES 1500u /* the interfaces' MTU */
#define PACKETS_MAX 8192u  /* on the way in one direction; more are lost, too */
#define SECOND_NS UINT64_C(1000000000)
#define MILLISECOND_NS UINT64_C(1000000)

struct packet {
    uint64_t gone_ns, due_ns; /* out of the buffer; at the other end */
    size_t size_bytes;
    uint8_t bytes[PACKET_BYTES];
};

struct direction {
    int from, to;
    uint64_t free_ns;       /* when the last packet has left the buffer */
    uint64_t first, last;   /* packets on the way, [first, last), modulo PACKETS_MAX */
    struct packet *packets; /* PACKETS_MAX */
};

static struct {
    uint64_t bits_per_second, delay_ns, buffer_bytes;
} shape;

static _Noreturn void give_up(const char *what)
{
    fprintf(stderr, "shaped_link: %s: %s\n", what, strerror(errno));
    exit(EXIT_NO_LINK);
}

/* ---- the ends ---------------------------------------------------------------------------------------- */

static void write_file(const char *path, const char *text)
{
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    if (fd < 0 || write(fd, text, strlen(text)) < 0)
        give_up(path);
    close(fd);
}

static void become_root_of_a_namespace(void)
{
    char users[64], groups[64];
    snprintf(users, sizeof(users), "0 %u 1", (unsigned)geteuid());
    snprintf(groups, sizeof(groups), "0 %u 1", (unsigned)getegid());
    if (unshare(CLONE_NEWUSER))
        give_up("user namespace");
    write_file("/proc/self/setgroups", "deny");
    write_file("/proc/self/uid_map", users);
    write_file("/proc/self/gid_map", groups);
}

static void set_address(int control, struct ifreq *interface, unsigned long request, const char *address)
{
    struct sockaddr_in *place = (struct sockaddr_in *)(void *)&interface->ifr_addr;
    *place = (struct sockaddr_in){.sin_family = AF_INET};
    inet_pton(AF_INET, address, &place->sin_addr);
    if (ioctl(control, request, interface))
        give_up(address);
}

static void bring_up(int control, struct ifreq *interface)
{
    interface->ifr_flags = IFF_UP | IFF_RUNNING;
    if (ioctl(control, SIOCSIFFLAGS, interface))
        give_up(interface->ifr_name);
}

/* Moves this process to a network of its own with that address; its packets are the descriptor's. */
static int open_end(const char *address)
{
    struct ifreq loopback = {.ifr_name = "lo"};
    struct ifreq interface = {.ifr_name = "link", .ifr_flags = IFF_TUN | IFF_NO_PI};
    if (unshare(CLONE_NEWNET))
        give_up("network namespace");
    int tun = open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (tun < 0 || ioctl(tun, TUNSETIFF, &interface))
        give_up("/dev/net/tun");
    int control = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (control < 0)
        give_up("socket");
    set_address(control, &interface, SIOCSIFADDR, address);
    set_address(control, &interface, SIOCSIFNETMASK, "255.255.255.252");
    bring_up(control, &interface);
    bring_up(control, &loopback);
    close(control);
    return tun;
}

/* Here, where the process is now. `out` >= 0: its standard output. */
static pid_t start(char **command, int out)
{
    pid_t child = fork();
    if (child < 0)
        give_up("fork");
    if (child > 0)
        return child;
    if (out >= 0)
        dup2(out, STDOUT_FILENO);
    execvp(command[0], command);
    fprintf(stderr, "shaped_link: %s: %s\n", command[0], strerror(errno));
    _exit(127);
}

static bool becomes_ready(int output)
{
    char line[512];
    FILE *lines = fdopen(output, "r");
    while (lines && fgets(line, sizeof(line), lines))
        if (strncmp(line, "READY", 5) == 0)
            return true; /* the pipe stays open: it may print more */
    return false;
}

/* ---- the way ----------------------------------------------------------------------------------------- */

static uint64_t buffered_bytes(const struct direction *way, uint64_t now)
{
    uint64_t bytes = 0;
    for (uint64_t i = way->last; i > way->first; i--) {
        const struct packet *packet = &way->packets[(i - 1) % PACKETS_MAX];
        if (packet->gone_ns <= now)
            break;
        bytes += packet->size_bytes;
    }
    return bytes;
}

static void take(struct direction *way)
{
    static uint8_t lost[PACKET_BYTES];
    for (;;) {
        struct packet *packet = &way->packets[way->last % PACKETS_MAX];
        bool full = way->last - way->first == PACKETS_MAX;
        ssize_t size_bytes = read(way->from, full ? lost : packet->bytes, PACKET_BYTES);
        uint64_t now = monotonic_now_ns();
        if (size_bytes <= 0)
            return;
        if (full || buffered_bytes(way, now) + (uint64_t)size_bytes > shape.buffer_bytes)
            continue;
        packet->size_bytes = (size_t)size_bytes;
        way->free_ns =
            (way->free_ns > now ? way->free_ns : now) + packet->size_bytes * 8 * SECOND_NS / shape.bits_per_second;
        packet->gone_ns = way->free_ns;
        packet->due_ns = way->free_ns + shape.delay_ns;
        way->last++;
    }
}

/* Returns when the next one is due. */
static uint64_t give(struct direction *way)
{
    for (; way->first < way->last; way->first++) {
        const struct packet *packet = &way->packets[way->first % PACKETS_MAX];
        if (packet->due_ns > monotonic_now_ns())
            return packet->due_ns;
        if (write(way->to, packet->bytes, packet->size_bytes) < 0 && errno == EAGAIN)
            return monotonic_now_ns() + MILLISECOND_NS;
    }
    return UINT64_MAX;
}

/* Until the process has ended. */
static void carry(struct direction ways[2], int process)
{
    struct pollfd watched[] = {{.fd = ways[0].from, .events = POLLIN},
                               {.fd = ways[1].from, .events = POLLIN},
                               {.fd = process, .events = POLLIN}};
    while (!watched[2].revents) {
        uint64_t due_ns = UINT64_MAX;
        for (int i = 0; i < 2; i++) {
            take(&ways[i]);
            uint64_t of_way_ns = give(&ways[i]);
            due_ns = of_way_ns < due_ns ? of_way_ns : due_ns;
        }
        uint64_t now = monotonic_now_ns(), wait_ns = due_ns > now ? due_ns - now : 0;
        struct timespec wait = {.tv_sec = 0, .tv_nsec = (long)(wait_ns % SECOND_NS)};
        if (wait_ns >= SECOND_NS)
            wait = (struct timespec){.tv_sec = 1};
        ppoll(watched, 3, &wait, NULL);
    }
}

/* ---- the programs ------------------------------------------------------------------------------------ */

static uint64_t number(const char *text)
{
    char *end;
    uint64_t value = strtoull(text, &end, 10);
    if (end == text || *end != '\0' || value > 100000000) {
        fprintf(stderr, "shaped_link: \"%s\" is no such number\n", text);
        exit(2);
    }
    return value;
}

static char **parse(int argc, char **argv)
{
    int at = 4;
    while (at < argc && strcmp(argv[at], "--") != 0)
        at++;
    if (at == 4 || at + 1 >= argc) {
        fputs("usage: shaped_link KBIT_PER_S DELAY_MS BUFFER_KIB NEAR_COMMAND .. -- FAR_COMMAND ..\n", stderr);
        exit(2);
    }
    argv[at] = NULL;
    shape.bits_per_second = number(argv[1]) * 1000;
    shape.delay_ns = number(argv[2]) * MILLISECOND_NS;
    shape.buffer_bytes = number(argv[3]) * 1024;
    if (!shape.bits_per_second) {
        fputs("shaped_link: a link needs a rate\n", stderr);
        exit(2);
    }
    return argv + at + 1;
}

int main(int argc, char **argv)
{
    char **far_command = parse(argc, argv), **near_command = argv + 4;
    int said[2], status = 0;
    if (geteuid() != 0)
        become_root_of_a_namespace();
    int near = open_end("10.77.0.1");
    if (pipe2(said, O_CLOEXEC))
        give_up("pipe");
    pid_t near_child = start(near_command, said[1]);
    close(said[1]);
    int far = open_end("10.77.0.2");
    struct direction ways[2] = {
        {.from = near, .to = far, .packets = malloc(PACKETS_MAX * sizeof(struct packet))},
        {.from = far, .to = near, .packets = malloc(PACKETS_MAX * sizeof(struct packet))},
    };
    if (ways[0].packets && ways[1].packets && becomes_ready(said[0])) {
        pid_t far_child = start(far_command, -1);
        int process = (int)syscall(SYS_pidfd_open, far_child, 0);
        if (process < 0)
            give_up("pidfd");
        carry(ways, process);
        waitpid(far_child, &status, 0);
    } else {
        fputs("shaped_link: the near program did not become ready\n", stderr);
        status = -1;
    }
    kill(near_child, SIGTERM);
    waitpid(near_child, NULL, 0);
    free(ways[0].packets);
    free(ways[1].packets);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}
