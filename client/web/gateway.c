/* SPDX-License-Identifier: MIT */
/* The server for HTTP and WebSockets. */
#include "web/gateway.h"
#include "web/callers.h"
#include "web/page.h"
#include "protocol/common/clock.h"
#include "protocol/plain_text.h"

#include <libwebsockets.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define HEADERS_BYTES 2048
#define NAME_BYTES 256
#define MISDIRECTED 421 /* HTTP status: this server has another name */
#define CHECK_US 250000 /* catches a signal that arrived just before the wait */
#define REQUEST_TIMEOUT_S 20
#define PING_S 20
#define SILENCE_S 60
#define MESSAGES_PER_S 250.0   /* a mouse reports 125 to 250 times a second, each at most with a shown frame .. */
#define MESSAGES_AT_ONCE 500.0 /* .. after the browser has paused */

_Static_assert(LWS_PRE <= PARCEL_ROOM, "libwebsockets writes its frame's header in front of a message");

struct gateway {
    const struct gateway_options *options;
    struct seat_options seat;
    struct lws_context *context;
    const char *machine; /* this machine's name, accepted if it listens beyond loopback; NULL: it does not */
    int port;            /* port of the first address */
    struct web_callers callers;
    struct web_links links;
    unsigned viewers;
    bool has_reported_origin;
    lws_sorted_usec_list_t check;
};

/* State of an HTTP request or WebSocket; cleared by libwebsockets. */
struct visitor {
    const struct page_file *file; /* file being sent */
    struct seat *seat;
    char message[WEB_REQUEST_BYTES_MAX];
    size_t message_bytes;
    double messages; /* messages that may still arrive at once */
    uint64_t last_ns;
};

static struct gateway *gateway_of(struct lws *wsi)
{
    return lws_context_user(lws_get_context(wsi));
}

/* ---- the right to come in ---- */

/* False for a Host of another site, whose pages could then read ours (DNS rebinding). */
static bool is_own_host(const struct gateway *gateway, struct lws *wsi)
{
    char host[NAME_BYTES];
    return lws_hdr_copy(wsi, host, sizeof(host), WSI_TOKEN_HOST) > 0 &&
           (web_host_is_ours(host, gateway->options->hosts, gateway->options->host_count) ||
            (gateway->machine && web_host_is_ours(host, &gateway->machine, 1)));
}

/* True if the page itself made the request, not a page of another site in the same browser. */
static bool is_own_origin(struct lws *wsi)
{
    char origin[NAME_BYTES], host[NAME_BYTES];
    if (lws_hdr_copy(wsi, origin, sizeof(origin), WSI_TOKEN_ORIGIN) <= 0 ||
        lws_hdr_copy(wsi, host, sizeof(host), WSI_TOKEN_HOST) <= 0)
        return false;
    const char *behind_scheme = strstr(origin, "://");
    return behind_scheme && strcmp(behind_scheme + 3, host) == 0 &&
           (strncmp(origin, "http://", 7) == 0 || strncmp(origin, "https://", 8) == 0);
}

/* Reports an Origin that differs from the Host, which happens to the page itself behind a proxy that changes
 * the Host. Only once, as a foreign page may try any number of times. */
static void report_other_origin(struct gateway *gateway, struct lws *wsi)
{
    char origin[NAME_BYTES] = "", host[NAME_BYTES] = "";
    if (gateway->has_reported_origin || lws_hdr_copy(wsi, origin, sizeof(origin), WSI_TOKEN_ORIGIN) <= 0 ||
        lws_hdr_copy(wsi, host, sizeof(host), WSI_TOKEN_HOST) <= 0)
        return;
    gateway->has_reported_origin = true;
    fputs("farlight: a page with the link was refused: its Origin is ", stderr);
    plain_text_print(stderr, origin);
    fputs(", but its Host ", stderr);
    plain_text_print(stderr, host);
    fputs(" (a proxy has to pass the Host on; nginx: proxy_set_header Host $http_host)\n", stderr);
}

/* The HTTP status that refuses a WebSocket; 0: accepted. */
static unsigned refuse_socket(struct gateway *gateway, struct lws *wsi, enum web_right *right)
{
    char path[NAME_BYTES];
    if (!is_own_host(gateway, wsi))
        return MISDIRECTED;
    const int length = lws_hdr_copy(wsi, path, sizeof(path), WSI_TOKEN_GET_URI);
    const char *name = length > 0 ? web_links_find(&gateway->links, path, right) : NULL;
    if (!name || strcmp(name, "view") != 0)
        return HTTP_STATUS_UNAUTHORIZED;
    if (!is_own_origin(wsi)) {
        report_other_origin(gateway, wsi);
        return HTTP_STATUS_FORBIDDEN;
    }
    return gateway->viewers < gateway->options->viewers ? 0 : HTTP_STATUS_SERVICE_UNAVAILABLE;
}

/* ---- pages ---- */

static const char *const headers[][2] = {
    {"content-security-policy:",
     "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
     "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"x-content-type-options:", "nosniff"},
    {"x-frame-options:", "DENY"},
    {"referrer-policy:", "no-referrer"},
    {"cross-origin-opener-policy:", "same-origin"},
    {"cross-origin-resource-policy:", "same-origin"},
    {"cache-control:", "no-store"},
};

static int begin_page(struct lws *wsi, struct visitor *visitor, const struct page_file *file, unsigned status)
{
    unsigned char buffer[LWS_PRE + HEADERS_BYTES], *at = buffer + LWS_PRE, *start = at,
                                                   *end = buffer + sizeof(buffer) - 1;
    if (lws_add_http_common_headers(wsi, status, file->type, (lws_filepos_t)(file->end - file->bytes), &at, end))
        return 1;
    for (size_t i = 0; i < sizeof(headers) / sizeof(headers[0]); i++)
        if (lws_add_http_header_by_name(wsi, (const unsigned char *)headers[i][0],
                                        (const unsigned char *)headers[i][1], (int)strlen(headers[i][1]), &at,
                                        end))
            return 1;
    if (lws_finalize_write_http_header(wsi, start, &at, end))
        return 1;
    visitor->file = file;
    lws_callback_on_writable(wsi);
    return 0;
}

/* Redirects a link whose last slash was lost. The address is relative, as a proxy may add a path in front. */
static int add_slash(struct lws *wsi, const char *path)
{
    unsigned char buffer[LWS_PRE + HEADERS_BYTES], *at = buffer + LWS_PRE;
    char to[WEB_TOKEN_LENGTH + 2];
    const int length = snprintf(to, sizeof(to), "%s/", path + 1);
    return lws_http_redirect(wsi, HTTP_STATUS_MOVED_PERMANENTLY, (const unsigned char *)to, length, &at,
                             buffer + sizeof(buffer) - 1) < 0 ||
                   lws_http_transaction_completed(wsi)
               ? -1
               : 0;
}

static bool lacks_slash(const struct gateway *gateway, const char *path)
{
    char whole[WEB_TOKEN_LENGTH + 3];
    enum web_right right;
    return strlen(path) == WEB_TOKEN_LENGTH + 1 && snprintf(whole, sizeof(whole), "%s/", path) > 0 &&
           web_links_find(&gateway->links, whole, &right);
}

static int on_page(struct gateway *gateway, struct lws *wsi, struct visitor *visitor, const char *path)
{
    if (!is_own_host(gateway, wsi))
        return begin_page(wsi, visitor, &page_misdirected, MISDIRECTED);
    const bool is_get = lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) > 0;
    enum web_right right;
    const char *name = web_links_find(&gateway->links, path, &right);
    if (!name && is_get && lacks_slash(gateway, path))
        return add_slash(wsi, path);
    if (!name)
        return begin_page(wsi, visitor, &page_denied, HTTP_STATUS_UNAUTHORIZED);
    const struct page_file *file = page_find(name);
    if (is_get && file)
        return begin_page(wsi, visitor, file, HTTP_STATUS_OK);
    lws_return_http_status(wsi, is_get ? HTTP_STATUS_NOT_FOUND : HTTP_STATUS_METHOD_NOT_ALLOWED, NULL);
    return lws_http_transaction_completed(wsi) ? -1 : 0;
}

static int send_page(struct lws *wsi, struct visitor *visitor)
{
    const struct page_file *file = visitor->file;
    if (!file)
        return 0;
    const size_t bytes = (size_t)(file->end - file->bytes);
    unsigned char *copy = malloc(LWS_PRE + bytes);
    if (!copy)
        return -1;
    memcpy(copy + LWS_PRE, file->bytes, bytes);
    const int sent = lws_write(wsi, copy + LWS_PRE, bytes, LWS_WRITE_HTTP_FINAL);
    free(copy);
    visitor->file = NULL;
    return sent < (int)bytes || lws_http_transaction_completed(wsi) ? -1 : 0;
}

/* ---- WebSockets ---- */

static int refuse(struct lws *wsi, enum lws_close_status status, const char *why)
{
    unsigned char reason[100]; /* a close frame holds 123 bytes; libwebsockets must be able to write to them */
    const size_t bytes = strnlen(why, sizeof(reason));
    memcpy(reason, why, bytes);
    lws_close_reason(wsi, status, reason, bytes);
    return -1;
}

static int on_upgrade(struct gateway *gateway, struct lws *wsi, const char *to)
{
    enum web_right right = WEB_READS;
    const unsigned status = refuse_socket(gateway, wsi, &right);
    if (strcmp(to, "websocket") != 0)
        return -1;
    if (status != 0)
        lws_return_http_status(wsi, status, NULL);
    struct web_caller *caller = lws_get_opaque_user_data(wsi);
    if (caller)
        caller->right = right;
    return status != 0;
}

static int open_seat(struct gateway *gateway, struct lws *wsi, struct visitor *visitor)
{
    struct fl_error error = {0};
    visitor->messages = MESSAGES_AT_ONCE;
    visitor->last_ns = monotonic_now_ns();
    const struct web_caller *caller = lws_get_opaque_user_data(wsi);
    struct seat_options options = gateway->seat;
    options.may_edit = caller && caller->right == WEB_EDITS;
    visitor->seat = seat_create(&options, &error);
    if (!visitor->seat)
        return refuse(wsi, LWS_CLOSE_STATUS_UNEXPECTED_CONDITION, "out of memory or threads");
    gateway->viewers++;
    return 0;
}

static void close_seat(struct gateway *gateway, struct visitor *visitor)
{
    if (!visitor || !visitor->seat)
        return;
    seat_destroy(visitor->seat);
    visitor->seat = NULL;
    gateway->viewers--;
}

static bool comes_too_often(struct visitor *visitor)
{
    const uint64_t now_ns = monotonic_now_ns();
    visitor->messages += (double)(now_ns - visitor->last_ns) * 1e-9 * MESSAGES_PER_S;
    visitor->messages = visitor->messages < MESSAGES_AT_ONCE ? visitor->messages : MESSAGES_AT_ONCE;
    visitor->last_ns = now_ns;
    visitor->messages -= 1;
    return visitor->messages < 0;
}

static int on_message(struct lws *wsi, struct visitor *visitor, const char *bytes, size_t count)
{
    struct web_request request;
    struct fl_error error = {0};
    if (lws_frame_is_binary(wsi))
        return refuse(wsi, LWS_CLOSE_STATUS_UNACCEPTABLE_OPCODE, "messages are text");
    if (count > sizeof(visitor->message) - visitor->message_bytes)
        return refuse(wsi, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE, "the message is too long");
    memcpy(visitor->message + visitor->message_bytes, bytes, count);
    visitor->message_bytes += count;
    if (comes_too_often(visitor)) /* parts of a message count, too */
        return refuse(wsi, LWS_CLOSE_STATUS_POLICY_VIOLATION, "too many messages");
    if (!lws_is_final_fragment(wsi) || lws_remaining_packet_payload(wsi) > 0)
        return 0;
    const size_t whole = visitor->message_bytes;
    visitor->message_bytes = 0;
    if (!web_request_read(visitor->message, whole, &request, &error))
        return refuse(wsi, LWS_CLOSE_STATUS_POLICY_VIOLATION, error.field);
    if (!seat_request(visitor->seat, &request))
        return refuse(wsi, LWS_CLOSE_STATUS_POLICY_VIOLATION, "this link may not edit, or not yet");
    return 0;
}

static int on_writable(struct lws *wsi, struct visitor *visitor)
{
    bool has_ended = false;
    struct parcel *parcel = visitor->seat ? seat_take(visitor->seat, &has_ended) : NULL;
    if (parcel) {
        const int sent = lws_write(wsi, parcel->data + PARCEL_ROOM, parcel->bytes,
                                   parcel->is_text ? LWS_WRITE_TEXT : LWS_WRITE_BINARY);
        const bool is_lost = sent < (int)parcel->bytes;
        free(parcel);
        if (is_lost)
            return -1;
        lws_callback_on_writable(wsi);
        return 0;
    }
    return has_ended ? refuse(wsi, LWS_CLOSE_STATUS_GOINGAWAY, "the view has ended") : 0;
}

/* ---- connections ---- */

/* Limit for one address: each browser has a WebSocket, and up to six connections for the files of a page;
 * behind ssh and proxies many browsers share an address. */
static unsigned callers_max(const struct gateway *gateway)
{
    return 6 * gateway->options->viewers + 16;
}

static int filter_caller(const struct gateway *gateway, lws_sockfd_type fd)
{
    char peer[CALLER_PEER_BYTES] = "";
    lws_get_peer_simple_fd(fd, peer, sizeof(peer));
    return !web_callers_has_room(&gateway->callers, peer, callers_max(gateway));
}

static void add_caller(struct gateway *gateway, struct lws *wsi)
{
    char peer[CALLER_PEER_BYTES] = "";
    lws_get_peer_simple(wsi, peer, sizeof(peer));
    lws_set_opaque_user_data(wsi, web_callers_add(&gateway->callers, peer));
}

static void remove_caller(struct lws *wsi)
{
    struct web_caller *caller = lws_get_opaque_user_data(wsi);
    if (caller)
        caller->is_there = false;
    lws_set_opaque_user_data(wsi, NULL);
}

static int on_event(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t bytes)
{
    struct visitor *visitor = user;
    switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION: /* `in` is a descriptor */
        return filter_caller(gateway_of(wsi), (lws_sockfd_type)(intptr_t)in);
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
        add_caller(gateway_of(wsi), wsi);
        return 0;
    case LWS_CALLBACK_WSI_DESTROY:
        remove_caller(wsi);
        return 0;
    case LWS_CALLBACK_HTTP:
        return on_page(gateway_of(wsi), wsi, visitor, in);
    case LWS_CALLBACK_HTTP_WRITEABLE:
        return send_page(wsi, visitor);
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
        return on_upgrade(gateway_of(wsi), wsi, in);
    case LWS_CALLBACK_ESTABLISHED:
        return open_seat(gateway_of(wsi), wsi, visitor);
    case LWS_CALLBACK_RECEIVE:
        return on_message(wsi, visitor, in, bytes);
    case LWS_CALLBACK_SERVER_WRITEABLE:
        return on_writable(wsi, visitor);
    case LWS_CALLBACK_CLOSED:
        close_seat(gateway_of(wsi), visitor);
        return 0;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED: /* a seat has a parcel */
        lws_callback_on_writable_all_protocol(lws_get_context(wsi), lws_get_protocol(wsi));
        return 0;
    default:
        return 0; /* disables libwebsockets' own pages and uploads */
    }
}

/* ---- beginning and end ---- */

static void seat_changed(void *user)
{
    struct gateway *gateway = user;
    lws_cancel_service(gateway->context);
}

static void check_again(lws_sorted_usec_list_t *check)
{
    struct gateway *gateway = lws_container_of(check, struct gateway, check);
    lws_sul_schedule(gateway->context, 0, check, check_again, CHECK_US);
}

static const struct lws_protocols protocols[] = {
    {"farlight", on_event, sizeof(struct visitor), WEB_REQUEST_BYTES_MAX, 0, NULL, 0}, {0}};

static bool open_context(struct gateway *gateway, struct fl_error *error)
{
    static const lws_retry_bo_t alive = {.secs_since_valid_ping = PING_S, .secs_since_valid_hangup = SILENCE_S};
    const struct lws_context_creation_info info = {.port = CONTEXT_PORT_NO_LISTEN,
                                                   .user = gateway,
                                                   .gid = -1,
                                                   .uid = -1,
                                                   .retry_and_idle_policy = &alive,
                                                   .server_string = "farlight-web",
                                                   .options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS};
    lws_set_log_level(0, NULL); /* its log has paths, which contain the token */
    gateway->context = lws_create_context(&info);
    return gateway->context || fl_error_set(error, FL_ERROR_SYSTEM, "", "libwebsockets does not start");
}

/* Listens at an address. Port 0 of the first address is chosen by the kernel, and the others with port 0 use
 * the same. */
static bool listen_at(struct gateway *gateway, const struct web_address *address, struct fl_error *error)
{
    const uint64_t of_four = LWS_SERVER_OPTION_DISABLE_IPV6;
    const uint64_t of_six =
        LWS_SERVER_OPTION_IPV6_V6ONLY_MODIFY | (address->is_any ? 0 : LWS_SERVER_OPTION_IPV6_V6ONLY_VALUE);
    const bool is_first = address == gateway->options->listens;
    char host[sizeof(address->host) + 2];
    web_address_print(address, host, sizeof(host));
    const struct lws_context_creation_info info = {
        .port = address->port == 0 && !is_first ? gateway->port : address->port,
        .iface = address->host,
        .vhost_name = host,
        .protocols = protocols,
        .timeout_secs = REQUEST_TIMEOUT_S,
        .keepalive_timeout = REQUEST_TIMEOUT_S,
        .options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND | (address->is_v6 ? of_six : of_four)};
    struct lws_vhost *vhost = lws_create_vhost(gateway->context, &info);
    if (!vhost)
        return fl_error_set(error, FL_ERROR_SYSTEM, "--listen",
                            "cannot listen at %s:%d: is something else there, or is it not this machine's?", host,
                            info.port);
    if (is_first)
        gateway->port = lws_get_vhost_listen_port(vhost);
    if (address->is_any)
        gateway->machine = lws_canonical_hostname(gateway->context);
    return true;
}

/* Prints the links. With several, each is followed by its right, after a blank, so that neither terminals nor
 * scripts take it for a part of the link. */
static void announce(const struct gateway *gateway)
{
    static const char *const gives[WEB_RIGHT_COUNT] = {
        [WEB_READS] = "  to look", [WEB_EDITS] = "  to look and edit"};
    const bool has_several = gateway->options->allow_edit;
    const struct web_address *address = gateway->options->listens;
    char host[NAME_BYTES];
    web_address_print(address, host, sizeof(host));
    for (int right = 0; right <= (has_several ? WEB_EDITS : WEB_READS); right++)
        printf("http://%s:%d/%s/%s\n", address->is_any ? gateway->machine : host, gateway->port,
               gateway->links.tokens[right], has_several ? gives[right] : "");
    fflush(stdout);
}

struct gateway *gateway_create(const struct gateway_options *options, struct fl_error *error)
{
    struct gateway *gateway = calloc(1, sizeof(*gateway));
    if (!gateway) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    gateway->options = options;
    gateway->seat = options->seat;
    gateway->seat.changed = seat_changed;
    gateway->seat.user = gateway;
    bool is_open = (web_links_make(&gateway->links, options->allow_edit) ||
                    fl_error_set(error, FL_ERROR_SYSTEM, "", "libsodium does not start")) &&
                   open_context(gateway, error);
    for (size_t i = 0; is_open && i < options->listen_count; i++)
        is_open = listen_at(gateway, &options->listens[i], error);
    if (is_open)
        return gateway;
    gateway_destroy(gateway);
    return NULL;
}

void gateway_run(struct gateway *gateway, struct fl_error *error)
{
    const struct gateway_options *options = gateway->options;
    bool has_failed = false;
    announce(gateway);
    check_again(&gateway->check);
    while (options->interrupt_signal() == 0 && !has_failed && lws_service(gateway->context, 0) >= 0)
        has_failed = options->has_failed && options->has_failed(options->user);
    lws_sul_schedule(gateway->context, 0, &gateway->check, NULL, LWS_SET_TIMER_USEC_CANCEL);
    if (options->interrupt_signal() != 0)
        fl_error_set(error, FL_ERROR_INTERRUPTED, "", "interrupted");
    else if (!has_failed)
        fl_error_set(error, FL_ERROR_SYSTEM, "", "libwebsockets failed");
}

void gateway_destroy(struct gateway *gateway)
{
    if (!gateway)
        return;
    if (gateway->context)
        lws_context_destroy(gateway->context);
    web_links_forget(&gateway->links);
    free(gateway);
}
