@title@
/* Lets a desk play records through the step: the program of a board with POSIX, or one to try the desk with.
   PROGRAM PORT [ADDRESS] answers datagrams of UDP at a port, of this machine alone where no address is given;
   PROGRAM /dev/ttyS1 answers on a serial line. On a board without POSIX call @name@_take from the interrupt of its UART. */
#define _DEFAULT_SOURCE
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include "@name@_link.h"

static @name@_link wire;

static int serial(const char *path)
{
    const int line = open(path, O_RDWR | O_NOCTTY);
    struct termios how;
    uint8_t byte;

    if (line < 0 || tcgetattr(line, &how) != 0) {
        perror(path);
        return 1;
    }
    cfmakeraw(&how);
    (void)tcsetattr(line, TCSANOW, &how);
    while (read(line, &byte, 1u) == 1) {
        if (@name@_take(&wire, byte) != 0 && write(line, wire.frame, @NAME@_FRAME) != (ssize_t)@NAME@_FRAME) {
            break;
        }
    }
    perror(path);
    return 1;
}

static int datagrams(uint16_t port, const char *address)
{
    const int link = socket(AF_INET, SOCK_DGRAM, 0);
    struct sockaddr_in here = {0};
    uint8_t bytes[1500];

    here.sin_family = AF_INET;
    here.sin_port = htons(port);
    here.sin_addr.s_addr = inet_addr(address);
    if (link < 0 || bind(link, (struct sockaddr *)&here, sizeof here) != 0) {
        perror("the port");
        return 1;
    }
    for (;;) {
        struct sockaddr_in from;
        socklen_t size = sizeof from;
        const ssize_t count = recvfrom(link, bytes, sizeof bytes, 0, (struct sockaddr *)&from, &size);

        wire.count = 0u; /* a datagram holds whole requests */
        for (ssize_t i = 0; i < count; ++i) {
            if (@name@_take(&wire, bytes[i]) != 0) {
                (void)sendto(link, wire.frame, @NAME@_FRAME, 0, (struct sockaddr *)&from, size);
            }
        }
    }
}

int main(int count, char *words[])
{
    if (count < 2) {
        (void)fprintf(stderr, "give a port, or a serial line such as /dev/ttyS1\n");
        return 1;
    }
    if (words[1][0] == '/') {
        return serial(words[1]);
    }
    return datagrams((uint16_t)strtoul(words[1], NULL, 10), count > 2 ? words[2] : "127.0.0.1");
}
